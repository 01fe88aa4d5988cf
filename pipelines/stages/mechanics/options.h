// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/options/options.h"

namespace organbake {

struct MechanicsStageOptions {
  MechanicsOptions mechanics = {.fem = true};
  MeshFrame frame;
};

void bind(OptionList& list, MechanicsStageOptions& options);

}  // namespace organbake
