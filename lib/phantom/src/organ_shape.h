// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "organbake/capture/solid_noise.h"

namespace organbake {

// The organ as a star-shaped body round `center`: with x = world − center, ρ = |x|, d = x / ρ,
//   F(x)  = r(d) − ρ                                  (> 0 inside, mm along the radius)
//   r(d)  = R(d) + a · N(R(d) d)                      (N: solid noise of two scales, a: bumps)
//   R(d)  = s R0 (1 + Σ A_k exp(κ_k (d·m_k − 1) − β_k (d·e_k)²))
// Lobes with β > 0 are drawn out across e_k. The first kNamedLobes lobes make a liver's outline,
// jittered by the seed, the rest are drawn from it. The lobes scale with s, the bumps stay in mm:
// a smaller organ has the same skin.
class OrganShape {
 public:
  OrganShape(std::uint64_t seed, double scale, const Eigen::Vector3d& center_mm);

  struct Sample {
    double value = 0;  // F
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };
  double value(const Eigen::Vector3d& world_mm) const;
  Sample sample(const Eigen::Vector3d& world_mm) const;
  // The surface's point in a unit direction.
  Eigen::Vector3d surface_point(const Eigen::Vector3d& direction) const;

  const Eigen::Vector3d& center_mm() const { return center_mm_; }
  double scale() const { return scale_; }
  // The surface lies between two spheres round the centre, and |∇F| stays below lipschitz() near
  // it. All three are measured over the sphere at construction, with a margin.
  double inner_radius_mm() const { return inner_radius_mm_; }
  double outer_radius_mm() const { return outer_radius_mm_; }
  double lipschitz() const { return lipschitz_; }

 private:
  static constexpr int kLobes = 16;
  using LobeAxes = Eigen::Matrix<double, kLobes, 3>;
  using LobeValues = Eigen::Array<double, kLobes, 1>;

  double smooth_radius(const Eigen::Vector3d& direction) const;
  double bump(const Eigen::Vector3d& offset_mm) const;
  void measure();

  Eigen::Vector3d center_mm_;
  double scale_;
  double bump_mm_;
  LobeAxes toward_, across_;
  LobeValues height_, sharpness_, narrowness_;
  SolidNoise broad_bumps_, fine_bumps_;
  double inner_radius_mm_ = 0, outer_radius_mm_ = 0, lipschitz_ = 1;
};

}  // namespace organbake
