// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

#include "organbake/geometry/shell_map.h"

namespace organbake {

// A prism's extent along the axes, its face's normal and its three edges' outward directions: a
// convex bound tight enough that a grid cell lists few faces.
struct PrismBounds {
  Eigen::Vector3d min, max;
  std::array<Eigen::Vector3d, 5> direction;  // normal, −normal, three edges
  std::array<double, 5> extent{};
  double slack = 0;  // mm; covers rounding, and what kWallTolerance lets in

  bool touches_sphere(const Eigen::Vector3d& center, double radius) const {
    for (std::size_t d = 0; d < direction.size(); ++d) {
      if (direction[d].dot(center) > extent[d] + radius) return false;
    }
    return true;
  }
  // Without a branch on the way: what lies in a cell but in no prism near it is told apart at once.
  bool holds(const Eigen::Vector3d& point) const {
    double beyond = direction[0].dot(point) - extent[0];
    for (std::size_t d = 1; d < direction.size(); ++d)
      beyond = std::max(beyond, direction[d].dot(point) - extent[d]);
    return beyond <= slack;
  }
};

// Of the shell over a face between two heights.
PrismBounds prism_bounds(const ShellMatrix& m, double lowest_mm, double highest_mm);

}  // namespace organbake
