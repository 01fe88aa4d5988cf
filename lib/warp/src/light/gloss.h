// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "light/skin_light.h"
#include "organbake/bundle/lighting.h"

namespace organbake {

// Lighting::glossy() for every pixel: in single precision, the sum of the lobes from a table, and
// nothing where it would not show.
class Gloss {
 public:
  explicit Gloss(const Lighting& lighting);

  bool none() const { return lamps_.empty(); }

  // Of `count` pixels whose vectors may have any length; RGB. Nothing for a normal that is 0.
  void shine(const SkinDirections& normals, const SkinDirections& toward_eye, int count,
             SkinPlanes<3>& gloss) const;

  // Whether it shows on a unit normal, or on one that leans from it by up to kLean.
  bool may_show(const Eigen::Vector3f& normal, const Eigen::Vector3f& toward_eye) const;

 private:
  static constexpr int kSteps = 1024;
  static constexpr float kLean = 0.2f;  // rad: more than the nodes of a lattice triangle differ
  struct Lamp {
    Eigen::Vector3f toward, color;
  };
  std::vector<Lamp> lamps_;
  float least_cosine_ = 1, inverse_range_ = 1;  // the range: 1 − least
  float least_near_cosine_ = 1;                 // of half-ways that a normal within kLean shows
  // Σ strength · cosine^exponent. Even in about the angle, where lobes are narrow.
  std::array<float, kSteps + 1> table_{};
};

}  // namespace organbake
