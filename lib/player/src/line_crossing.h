// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace organbake {

// How far along origin + t·direction the triangle lies, before (t > 0) or behind; nothing when it
// is missed.
inline std::optional<double> line_crossing(const Eigen::Vector3d& origin,
                                           const Eigen::Vector3d& direction,
                                           const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                           const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return std::nullopt;
  const Eigen::Vector3d from_a = origin - a, q = from_a.cross(ab);
  const double u = from_a.dot(p) / determinant, v = direction.dot(q) / determinant;
  constexpr double kEdge = -1e-9;  // nothing slips between two triangles
  if (u < kEdge || v < kEdge || u + v > 1 - kEdge) return std::nullopt;
  return ac.dot(q) / determinant;
}

}  // namespace organbake
