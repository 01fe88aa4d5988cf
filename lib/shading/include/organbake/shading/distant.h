// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "organbake/shading/grid.h"

namespace organbake {

// A light so far away that its rays are parallel, seen by an orthographic camera (the
// paper, 2.1.1): tilt is the light's direction in the image (0 = right, π/2 = down), slant its
// angle from the viewing axis. Z is depth away from the camera, in pixels; p = Z_x, q = Z_y.
struct DistantLight {
  double tilt_rad = 0;
  double slant_rad = 0;  // 0…π/2

  // (cos τ sin σ, sin τ sin σ, cos σ): the reflectance is (p, q, 1)·s / √(1+p²+q²).
  Eigen::Vector3d toward() const {
    return {std::cos(tilt_rad) * std::sin(slant_rad), std::sin(tilt_rad) * std::sin(slant_rad),
            std::cos(slant_rad)};
  }
};

// Reflectance of a slope, not clamped.
inline double lambert(double p, double q, const Eigen::Vector3d& toward) {
  return (p * toward.x() + q * toward.y() + toward.z()) / std::sqrt(1 + p * p + q * q);
}

struct TsaiShahOptions {
  DistantLight light;
  int iterations = 5;

  void check() const;  // throws UsageError: iterations in 1…1000000, finite light
};

struct TsaiShahEstimate {
  Grid<double> depth;   // Z, pixels, away from the camera
  double residual = 0;  // root mean square of I − R after the last iteration
};

// The paper's method (2.1.1; Tsai & Shah 1994): f = I − max(0, R), p and q backward differences of
// the last iteration's Z (Jacobi), both zero in the first column and row, and per pixel
//   Zⁿ = Zⁿ⁻¹ − K f,   K = df / (W + Σ_{m≤n} df_m²),   W = 1e-8.
// As printed the step is −f/df, which is 0/0 at Z = 0 under frontal light and for tilts of 135° and
// −45° and diverges elsewhere; the sum bounds it. Where df is 0 the depth stays what it is.
// `intensity` in 0…1; not finite counts as black. `start` = Z of the previous frame (Z_t⁰ =
// Z_{t−1}). Its depth is about as wrong as a flat plane under oblique light; it is here as the
// baseline.
TsaiShahEstimate shade_tsai_shah(const Plane& intensity, const TsaiShahOptions& options,
                                 const Grid<double>* start = nullptr);

struct LightEstimate {
  DistantLight light;
  double albedo = 1;  // the intensity of a surface that faces the light
};

// Tilt, slant and albedo of a distant light from one picture of something on a plain ground that
// faces the camera (or of relief about such a plane):
//   albedo  the brightest percent faces the light;
//   slant   the most frequent level is the ground's, ρ cos σ;
//   tilt    the lit side: Σ (I − ground)(x − x̄). To first order it is −(Σ Z)·s, whatever the
//           outline of the relief is, since Σ p x = Σ q y = −Σ Z.
// The convex reading is given; a hollow one has the tilt turned by π, and no picture can tell.
LightEstimate estimate_light(const Plane& intensity, const Mask& inside);

}  // namespace organbake
