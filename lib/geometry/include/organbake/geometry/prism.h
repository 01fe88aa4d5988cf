// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

#include "organbake/geometry/shell.h"

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

// The heights h at which a point P lies in the plane of a face's triangle offset by h: the roots of
//   det[E1(h), E2(h), P − X0(h)] = 0,
// a cubic in h whose coefficients are affine in P; what belongs to the face is computed once.
//
// Number: double, or lanes of it.
template <class Number>
struct HeightCubic {
  Number c0, c1, c2;
  double c3;
  Number value(const Number& h) const { return c0 + h * (c1 + h * (c2 + h * c3)); }
  Number slope(const Number& h) const { return c1 + h * (2 * c2 + h * 3 * c3); }
};

class PrismCubic {
 public:
  explicit PrismCubic(const ShellMatrix& m);

  struct Roots {
    std::array<double, 3> heights{};
    int count = 0;
  };
  template <class Number>
  HeightCubic<Number> at(const Number& px, const Number& py, const Number& pz) const {
    const Number x = px - corner_.x(), y = py - corner_.y(), z = pz - corner_.z();
    const auto along = [&](const Eigen::Vector3d& slope) -> Number {
      return slope.x() * x + slope.y() * y + slope.z() * z;
    };
    return {along(slope0_), along(slope1_) + constant1_, along(slope2_) + constant2_, constant3_};
  }

  // Real roots within ±max_height, smallest |h| first.
  Roots heights(const Eigen::Vector3d& point, double max_height) const;

 private:
  Eigen::Vector3d corner_;
  Eigen::Vector3d slope0_, slope1_, slope2_;  // of the coefficients of 1, h, h² along P − corner
  double constant1_, constant2_, constant3_;
};

}  // namespace organbake
