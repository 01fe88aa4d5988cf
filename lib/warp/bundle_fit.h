// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bundle/bundle.h"

namespace organbake {

// Throws BadDataError unless cameras, maps, viewing manifold, base layer and proxy go together.
void check_fit(const Bundle& bundle);

}  // namespace organbake
