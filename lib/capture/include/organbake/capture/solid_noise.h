// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Smooth functions that textures in space are made of.

#include <Eigen/Core>
#include <cstdint>

#include "organbake/core/smooth_step.h"

namespace organbake {

struct NoiseSample {
  double value = 0;
  Eigen::Vector3d gradient_per_mm = Eigen::Vector3d::Zero();
};

// Solid gradient noise (Perlin 2002: quintic fade, twice continuously differentiable) on a cubic
// lattice of cell_mm, with gradients spread over a cube instead of its 12 edge directions,
// whose grain follows the axes. Mean 0, standard deviation about 0.19, |value| < 1.5; next to no
// energy at wavelengths below one cell. The same numbers for the same seed on every machine.
class SolidNoise {
 public:
  SolidNoise(std::uint64_t seed, double cell_mm)
      : seed_(static_cast<std::uint32_t>(seed ^ (seed >> 32))), cells_per_mm_(1 / cell_mm) {}

  double value(const Eigen::Vector3d& point_mm) const;
  NoiseSample sample(const Eigen::Vector3d& point_mm) const;

 private:
  std::uint32_t seed_;
  double cells_per_mm_;
};

}  // namespace organbake
