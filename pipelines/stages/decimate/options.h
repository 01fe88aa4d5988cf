// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "organbake/decimate/decimate.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"

namespace organbake {

struct DecimateStageOptions {
  DecimateOptions decimate;          // but for its faces
  std::optional<double> faces = 80;  // none: as many as a tool can dent and shape needs
  double tool_radius_mm = 5;         // of that tool's tip
  MeshFrame frame;
};

void bind(OptionList& list, DecimateStageOptions& options);

}  // namespace organbake
