// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace organbake {

// A light so far away that its rays are parallel, seen by an orthographic camera (the
// paper, 2.1.1): tilt is the light's direction in the image (0 = right, π/2 = down), slant its
// angle from the viewing axis. Z is depth away from the camera, in pixels; p = Z_x, q = Z_y.
struct DistantLight {
  double tilt_rad = 0;
  double slant_rad = 0;  // 0…π/2

  // (cos τ sin σ, sin τ sin σ, cos σ): the reflectance is (p, q, 1)·s / √(1+p²+q²).
  Eigen::Vector3d toward() const;
};
DistantLight distant_light(const Eigen::Vector3d& toward);

// Reflectance of a slope, not clamped.
double lambert(double p, double q, const Eigen::Vector3d& toward);

}  // namespace organbake
