// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/bundle_options.h"

namespace organbake {

void bind(OptionList& list, BundleOptions& o) {
  list.add("surface", &o.surface,
           {.help = "keep the coloured surface in the bundle, to compare frames with"});
}

}  // namespace organbake
