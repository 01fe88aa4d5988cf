// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "decimate/decimate.h"
#include "formats/mesh_files.h"
#include "pipelines/options.h"

namespace organbake {

// A mesh that the command reads, and the unit of files that don't say theirs.
struct DecimateStageOptions {
  DecimateOptions decimate;          // but for its faces
  std::optional<double> faces = 80;  // none: as many as a tool can dent and shape needs
  double tool_radius_mm = 5;         // of that tool's tip
  MeshUnit unit = MeshUnit::mm;
};

void bind(OptionList& list, DecimateStageOptions& options);

}  // namespace organbake
