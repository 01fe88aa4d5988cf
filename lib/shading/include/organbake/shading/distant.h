// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>

#include "organbake/shading/grid.h"

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

struct DistantOptions {
  DistantLight light;
  double albedo = 1;  // the intensity of a surface that faces the light
  // How rough the surface may be where the image is silent, per pixel of the coarsest level; larger
  // follows the image, smaller stays flat.
  double roughness = 3;

  void check() const;  // throws UsageError
};

struct DistantEstimate {
  Plane depth;        // Z, pixels, away from the camera, mean 0
  double misfit = 0;  // root mean square of I − R; proves nothing about the depth
  // "flat", "near" or "far": the start (a plane, a dome towards the camera, a bowl) whose solution
  // explains the image with the least bending; "solid": a round thing in front of a plain ground.
  std::string branch;
  bool ambiguous = false;  // light within 10° of the viewing axis: relief may be inside out
  int refinements = 0;     // conjugate-gradient steps of the branch taken
};

// Whole-image least squares for a distant light:  Σ (I/ρ − max(0, R(p, q)))² + bending, by
// Gauss–Newton from coarse to fine (the bending weight falls on each level, so that the large shape
// settles before the detail). A light's picture leaves a surface free along the border it comes
// from: the border is held near one depth, as in pictures of something on a plain ground, unless it
// resists; of all that is left the least steep surface is taken. A solid with an occluding rim
// where one explains the image (rimmed_solid.h), else three starts; the branch taken is told. Under
// frontal light shape and its inverse give the same image, which `ambiguous` says. Deterministic.
DistantEstimate shade_distant(const Plane& intensity, const Mask& inside,
                              const DistantOptions& options, const Plane* previous = nullptr);

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
  double albedo = 1;          // the intensity of a surface that faces the light
  double tilt_error_rad = 0;  // one standard deviation: how far parts of the image disagree
  double slant_error_rad = 0;
  bool frontal = false;  // no tilt can be told; the light may as well be frontal
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
