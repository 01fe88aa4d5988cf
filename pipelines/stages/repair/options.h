// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/repair/repair.h"

namespace organbake {

struct RepairStageOptions {
  std::string mode = "auto";  // or none: the surface as it is
  RepairOptions repair;
  MeshFrame frame;
};

void bind(OptionList& list, RepairStageOptions& options);

}  // namespace organbake
