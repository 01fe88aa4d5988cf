// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/map_files.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/filtered_detail.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"

namespace organbake {

struct CaptureStageOptions {
  CaptureOptions capture;
  DetailOptions detail;
  double surface_edge_mm = 0;  // of the coloured surface; 0 = as it came
  double skin_edge_mm = 6;     // of the smooth skin over the proxy; 0 = none
  Material material;
  double exemplar_mm_per_pixel = 0;  // of the exemplar's pixels on its tissue; 0: there is none
  MapPacking packing;
  MeshFrame frame;
};

void bind(OptionList& list, CaptureStageOptions& options);

}  // namespace organbake
