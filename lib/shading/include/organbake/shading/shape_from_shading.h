// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "organbake/geometry/camera.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/grid.h"
#include "organbake/shading/grid_filters.h"

namespace organbake {

// Solves  ln I = −2v − ½ ln(1+G),  G = (1+x²+y²)(v_x² + v_y² + (x v_x + y v_y)²)  for v = ln r
// along the pixels' rays: a camera with its light at the optical centre and 1/r² falloff (Prados &
// Faugeras 2005). Godunov's upwind differences, Gauss–Seidel in the four orders of fast sweeping
// (Zhao 2005); at the border and at masked pixels only what lies inside is used. The viscosity
// solution is unique, so the start does not matter; one close to it saves sweeps.
//   log_image: ln I, one value per ray; inside: pixels to solve for; v: start, becomes the result.
// Ends when four sweeps change v by less than the tolerance.
void sweep_log_range(const Plane& log_image, const Mask& inside, const RayGrid& rays, Plane& v,
                     int most_sweeps, double tolerance);
// −½ ln I: the farthest that each pixel can be; a start that is right where the surface is frontal.
Plane farthest_log_range(const Plane& log_image);

// An image so coarse that most of its noise is gone, to hold a following frame against.
struct CoarseImage {
  Plane intensity, variance;
  Mask inside;
};

// A laparoscope: perspective camera, its light at the optical centre or a little beside it,
// 1/r² falloff (Prados & Faugeras 2005; Tankus, Sochen & Yeshurun 2005).
struct LaparoscopeOptions {
  // Of the light's exit from the optical centre, right and down, in mm. It needs a metric range.
  double light_offset_x_mm = 0;
  double light_offset_y_mm = 0;
  // The beam falls off as cosⁿ of the angle to the optical axis; 0 = the same in all directions.
  double beam_exponent = 0;
  // Share of the brightness that texture and interreflection may change without being taken for
  // shape. 0.004 suits clean renderings, 0.03 living tissue.
  double texture = 0.004;

  void check() const;  // throws UsageError
};

struct RangeEstimate {
  Plane log_range;  // ln r along each pixel's ray; no gaps, outside pixels are bridged
  // The intensity was divided by this before ln r was solved with albedo 1: for a known albedo ρ
  // (intensity = ρ cosθ / r²) ln r = log_range + ½ ln(ρ / intensity_unit).
  double intensity_unit = 1;
  bool usable = false;     // false: no lit pixel; log_range is then a flat plane's
  bool warm = false;       // started from `previous`
  int refinements = 0;     // conjugate-gradient steps, all levels; 0 where `previous` still holds
  double misfit = 0;       // root mean square of image/model − 1; proves nothing about the depth
  double unexplained = 0;  // the same at organ scale (a grid of at most 32 pixels a side)
  double noise = 0;        // estimated, share of the mean brightness
  CoarseImage seen;        // what log_range was found from
};

// ln r of every pixel, up to one constant (the albedo is unknown). `intensity` is linear, any gain;
// what is not inside, not finite or negative does not count. A `previous` estimate of the same size
// is taken over where the image shows the same scene but for its noise, and is the start for what
// has changed else. `range_mm` is the median range, for a light beside the camera. Deterministic,
// one thread. Throws BadDataError when sizes differ.
RangeEstimate shade_laparoscope(const Plane& intensity, const Mask& inside,
                                const Intrinsics& camera, const LaparoscopeOptions& options,
                                const RangeEstimate* previous = nullptr, double range_mm = 0);

// Brightness of a surface under the light as the options place it, over that under a light at the
// optical centre with an even beam. log_range_mm: ln r, r in mm; one value per ray.
// Where the surface turns away from the light the ratio is held at a twentieth.
Plane light_ratio(const Plane& log_range_mm, const RayGrid& rays,
                  const LaparoscopeOptions& options);

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
