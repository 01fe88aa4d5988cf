// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/options.h"
#include "stages/shared/volume_options.h"

namespace organbake {

struct InspectStageOptions {
  ReadStageOptions reading;
  MeshFrame frame;
};

inline void bind(OptionList& list, InspectStageOptions& o) {
  bind(list, o.reading);
  bind(list, o.frame);
}

}  // namespace organbake
