// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/prism_bounds.h"

#include <Eigen/Geometry>

namespace organbake {

// S(b, h) is linear in h for fixed b, so the prism lies in the convex hull of its six corners.
PrismBounds prism_bounds(const ShellMatrix& m, double lowest_mm, double highest_mm) {
  std::array<Eigen::Vector3d, 6> corners;
  for (int c = 0; c < 3; ++c) {
    const double b1 = c == 1, b2 = c == 2;
    corners[2 * c] = shell_point(m, b1, b2, highest_mm);
    corners[2 * c + 1] = shell_point(m, b1, b2, lowest_mm);
  }
  PrismBounds bounds;
  const Eigen::Vector3d a = m.col(1), b = m.col(2), n = a.cross(b).normalized();
  bounds.direction = {n, -n, a.cross(n).normalized(), (b - a).cross(n).normalized(),
                      n.cross(b).normalized()};
  bounds.min = bounds.max = corners[0];
  bounds.extent.fill(-std::numeric_limits<double>::infinity());
  constexpr double kSlack = 1e-6;  // of the prism's size
  bounds.slack = kSlack * (corners[1] - corners[2]).norm();
  for (const auto& corner : corners) {
    bounds.min = bounds.min.cwiseMin(corner);
    bounds.max = bounds.max.cwiseMax(corner);
    for (std::size_t d = 0; d < bounds.direction.size(); ++d) {
      bounds.extent[d] = std::max(bounds.extent[d], bounds.direction[d].dot(corner));
    }
  }
  return bounds;
}

}  // namespace organbake
