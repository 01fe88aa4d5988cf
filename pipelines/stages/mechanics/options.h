// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "formats/mesh_frame.h"
#include "mechanics/mechanics.h"
#include "pipelines/options.h"

namespace organbake {

struct MechanicsStageOptions {
  MechanicsOptions mechanics;
  MeshFrame frame;
};

void bind(OptionList& list, MechanicsStageOptions& options);

}  // namespace organbake
