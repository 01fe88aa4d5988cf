// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace organbake {

// An instrument's part as a capsule (a sphere when both ends agree), world millimetres.
struct Solid {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double radius_mm = 1;
  Eigen::Vector3f color = Eigen::Vector3f::Constant(0.35f);  // linear
  std::uint32_t instrument = 0;                              // that it is a part of

  bool operator==(const Solid& other) const = default;
};

}  // namespace organbake
