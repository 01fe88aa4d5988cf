// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/options/options.h"

namespace organbake {

struct FuseStageOptions {
  FusionOptions fusion;
  MeshUnit unit = MeshUnit::mm;  // of the depths
};

void bind(OptionList& list, FuseStageOptions& options);

}  // namespace organbake
