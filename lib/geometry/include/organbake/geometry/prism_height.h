// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "organbake/geometry/shell_map.h"

namespace organbake {

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
