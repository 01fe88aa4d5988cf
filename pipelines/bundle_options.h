// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "pipelines/options.h"

namespace organbake {

// A recipe's section `bundle`.
struct BundleOptions {
  bool surface = false;
};

void bind(OptionList& list, BundleOptions& options);

}  // namespace organbake
