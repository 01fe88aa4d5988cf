// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

namespace organbake {

// A picture's width or height as a document has it, in pixels: the whole number below, or 0, which
// Intrinsics::check() refuses, for what an int cannot hold.
inline int written_size(double number) {
  return std::isfinite(number) && std::abs(number) <= std::numeric_limits<int>::max()
             ? static_cast<int>(number)
             : 0;
}

}  // namespace organbake
