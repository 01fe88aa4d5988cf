// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/inspect/options.h"

#include "pipelines/stages/shared/reading_options.h"

namespace organbake {

void bind(OptionList& list, InspectStageOptions& o) {
  bind(list, o.reading);
  bind(list, o.frame);
}

}  // namespace organbake
