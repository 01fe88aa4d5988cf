// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace organbake {

// Eigen adds three floats up in another order where registers hold two of them: here it is fixed,
// so that every processor finds the same bits.
[[gnu::always_inline]] inline float ordered_dot(const Eigen::Vector3f& a,
                                                const Eigen::Vector3f& b) {
  return a.x() * b.x() + (a.y() * b.y() + a.z() * b.z());
}
[[gnu::always_inline]] inline Eigen::Vector3f unit_vector(const Eigen::Vector3f& v) {
  const float squared = ordered_dot(v, v);
  return squared > 0 ? Eigen::Vector3f(v / std::sqrt(squared)) : v;
}

}  // namespace organbake
