// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace organbake {

// What a fit minimises: the sum of weight · distance^power over samples of both surfaces. Power 2
// is the squared RMS; a high power nears the largest distance.
struct FitNorm {
  double power = 2;
  double scale = 1;  // distances are divided by it, so that high powers stay in range

  double energy(double distance2) const {
    return power == 2 ? distance2 : std::pow(distance2 / (scale * scale), 0.5 * power);
  }
};

// One sample's share of the Gauss–Newton equations: its proxy point p = Σ wₖ xₖ shall close the
// gap to its target. Only the gap's direction counts – along the surface a proxy may slide – with
// a little of the rest, so that the equations stay regular.
struct FitTerm {
  Eigen::Matrix3d matrix;
  Eigen::Vector3d right;

  FitTerm(const Eigen::Vector3d& gap, const Eigen::Vector3d& face_normal, double weight,
          const FitNorm& norm) {
    constexpr double kSliding = 0.005;
    const double distance2 = gap.squaredNorm();
    const Eigen::Vector3d along =
        distance2 > 1e-24 ? Eigen::Vector3d(gap / std::sqrt(distance2)) : face_normal;
    double w = weight, newton = 1;
    if (norm.power != 2) {
      w *= std::pow(distance2 / (norm.scale * norm.scale) + 1e-12, 0.5 * norm.power - 1);
      newton = 1 / (norm.power - 1);
    }
    matrix = w * (along * along.transpose() + kSliding * Eigen::Matrix3d::Identity());
    right = (w * newton) * gap;
  }
};

}  // namespace organbake
