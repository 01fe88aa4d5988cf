// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/inspect/options.h"

#include "organbake/pipelines/stage_binding.h"

#include "stages/shared/reading_options.h"

namespace organbake {

void bind(OptionList& list, InspectStageOptions& o) {
  bind(list, o.reading);
  bind(list, o.frame);
}

StageOptions inspect_options() { return make_options<InspectStageOptions>(); }

}  // namespace organbake
