// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

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

}  // namespace organbake
