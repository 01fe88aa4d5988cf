// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "formats/mesh_files.h"
#include "pipelines/options.h"
#include "pipelines/stages/shared/reading_options.h"

namespace organbake {

struct InspectStageOptions {
  ReadStageOptions reading;
  MeshUnit unit = MeshUnit::mm;
};

void bind(OptionList& list, InspectStageOptions& options);

}  // namespace organbake
