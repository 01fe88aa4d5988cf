// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bundle/lighting.h"

namespace organbake {

// Lighting::glossy() for every pixel: in single precision, the sum of the lobes from a table, and
// nothing where it would not show.
class Gloss {
 public:
  explicit Gloss(const Lighting& lighting);

  bool none() const { return lamps_.empty(); }

  // Vectors of any length.
  Eigen::Vector3f at(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const {
    const Eigen::Vector3f eye = toward_eye.normalized();
    const float normal_squared = normal.squaredNorm();
    Eigen::Vector3f light = Eigen::Vector3f::Zero();
    for (const Lamp& lamp : lamps_) {
      const Eigen::Vector3f half = lamp.toward + eye;
      const float along = normal.dot(half);
      if (!(along > 0) || normal.dot(lamp.toward) <= 0) continue;
      const float cosine = along / std::sqrt(normal_squared * half.squaredNorm());
      if (cosine > least_cosine_) light += share(cosine) * lamp.color;
    }
    return light;
  }

  // Whether it shows on a unit normal, or on one that leans from it by up to kLean.
  bool may_show(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const;

 private:
  static constexpr int kSteps = 1024;
  static constexpr float kLean = 0.2f;  // rad: more than the nodes of a lattice triangle differ
  struct Lamp {
    Eigen::Vector3f toward, color;
  };
  // Σ strength · cosine^exponent. The table is even in about the angle, where lobes are narrow.
  float share(float cosine) const {
    const float place = kSteps * std::sqrt(std::max(0.0f, (1 - cosine) * inverse_range_));
    const int step = std::min(static_cast<int>(place), kSteps - 1);
    return table_[step] + (place - static_cast<float>(step)) * (table_[step + 1] - table_[step]);
  }

  std::vector<Lamp> lamps_;
  float least_cosine_ = 1, inverse_range_ = 1;  // the range: 1 − least
  std::array<float, kSteps + 1> table_{};
};

}  // namespace organbake
