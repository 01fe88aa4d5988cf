// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "organbake/bundle/bundle.h"
#include "organbake/core/error.h"

namespace organbake {

// A bundle's tetrahedra; throws UsageError where there are none.
inline const TetrahedralBody& tetrahedra_of(const Bundle& bundle, std::string_view what) {
  if (bundle.mechanics.body) return *bundle.mechanics.body;
  throw UsageError(std::string(what) + " is made of tetrahedra, which '" + bundle.manifest.name +
                   "' does not have; bake it anew without --set mechanics.fem=false");
}

}  // namespace organbake
