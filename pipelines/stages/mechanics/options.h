// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "formats/mesh_files.h"
#include "mechanics/mechanics.h"
#include "pipelines/options.h"

namespace organbake {

struct MechanicsStageOptions {
  MechanicsOptions mechanics;
  MeshUnit unit = MeshUnit::mm;
};

void bind(OptionList& list, MechanicsStageOptions& options);

}  // namespace organbake
