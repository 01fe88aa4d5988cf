// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace organbake {

// The least turn that brings the direction `from` to `to`, both of any length but 0. Eigen's own
// template, which takes GCC fifteen seconds in each file that uses it, compiled once.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from,
                                                  const Eigen::Vector3d& to);

}  // namespace organbake
