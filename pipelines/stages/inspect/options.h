// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "stages/shared/reading_options.h"

namespace organbake {

struct InspectStageOptions {
  ReadStageOptions reading;
  MeshFrame frame;
};

void bind(OptionList& list, InspectStageOptions& options);

}  // namespace organbake
