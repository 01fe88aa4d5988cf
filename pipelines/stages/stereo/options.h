// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/shading/depth_mesh.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {

struct StereoStageOptions {
  StereoOptions stereo;
  DepthMeshOptions mesh;
  StereoLayout layout = StereoLayout::none;  // none = seen from the first frame
  bool swap_eyes = false;
  bool masks = true;
  int every = 1, sharpest = 1;
  int mesh_frame = -1;  // −1 = the one with the most confidence
  MeshUnit unit = MeshUnit::mm;
  bool strict = false;
  bool keep_light = false;  // in surface.ply's colours
};

void bind(OptionList& list, StereoStageOptions& options);

}  // namespace organbake
