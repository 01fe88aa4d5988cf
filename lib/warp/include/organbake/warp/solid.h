// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace organbake {

// An instrument's part, world millimetres: all that lies within the radius of a segment, a point
// (both ends agree) or, with a third corner, a triangle: a capsule, a sphere or a rounded plate.
struct Solid {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double radius_mm = 1;
  std::optional<Eigen::Vector3d> corner = {};
  Eigen::Vector3f color = Eigen::Vector3f::Constant(0.35f);  // linear
  std::uint32_t instrument = 0;                              // that it is a part of

  bool operator==(const Solid& other) const = default;
};

}  // namespace organbake
