// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace organbake {

// Nothing that is meant lies farther from the origin: squares of such lengths lose the organ's
// millimetres, and rays overflow the floats they are traced in.
inline constexpr double kFarthest_mm = 1e9;

// Finite, and no coordinate beyond it. Eigen's largest coefficient passes over some NaN, so that
// both must be asked.
inline bool within_reach(const Eigen::Vector3d& position_mm) {
  return position_mm.allFinite() && position_mm.cwiseAbs().maxCoeff() <= kFarthest_mm;
}

}  // namespace organbake
