// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "formats/mesh_frame.h"
#include "pipelines/options.h"
#include "pipelines/stages/shared/reading_options.h"

namespace organbake {

struct InspectStageOptions {
  ReadStageOptions reading;
  MeshFrame frame;
};

void bind(OptionList& list, InspectStageOptions& options);

}  // namespace organbake
