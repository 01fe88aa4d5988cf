// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

// 0 up to `low`, 1 from `high` on, once differentiable between (Hermite). low < high.
inline double smooth_step(double low, double high, double value) {
  const double t = value <= low ? 0 : value >= high ? 1 : (value - low) / (high - low);
  return t * t * (3 - 2 * t);
}

}  // namespace organbake
