// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/inspect_options.h"

#include "stages/shared/reading_options.h"

namespace organbake {

void bind(OptionList& list, InspectStageOptions& o) {
  bind(list, o.reading);
  bind(list, o.frame);
}

}  // namespace organbake
