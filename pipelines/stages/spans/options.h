// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/clip_spans.h"
#include "organbake/options/options.h"

namespace organbake {

struct SpansStageOptions {
  SpanOptions search;
  double samples_per_s = 3;
  int best = 3;
};

void bind(OptionList& list, SpansStageOptions& options);

}  // namespace organbake
