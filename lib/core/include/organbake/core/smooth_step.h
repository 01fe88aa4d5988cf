// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <type_traits>

namespace organbake {

// 0 at `low` and before it, 1 at `high` and beyond, once differentiable between (Hermite); it falls
// where high < low. In doubles, unless a caller asks for floats.
template <class Real = double>
Real smooth_step(std::type_identity_t<Real> low, std::type_identity_t<Real> high,
                 std::type_identity_t<Real> value) {
  const Real t = std::clamp<Real>((value - low) / (high - low), 0, 1);
  return t * t * (3 - 2 * t);
}

}  // namespace organbake
