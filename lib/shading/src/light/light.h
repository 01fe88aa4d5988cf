// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "organbake/image/channel_image.h"
#include "organbake/shading/distant.h"
#include "organbake/shading/grid.h"
#include "organbake/shading/laparoscope.h"

namespace organbake {

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
//   relief's
//           outline, since Σ p x = Σ q y = −Σ Z.
// The convex reading is given; a hollow one has the tilt turned by π, and no picture can tell.
LightEstimate estimate_light(const Plane& intensity, const Mask& inside);

// Brightness of a surface under the light as the options place it, over that under a light at the
// optical centre with an even beam. log_range_mm: ln r, r in mm; one value per ray.
// Where the surface turns away from the light the ratio is held at a twentieth.
Plane light_ratio(const Plane& log_range_mm, const RayGrid& rays,
                  const LaparoscopeOptions& options);

// Red, green and blue in linear light.
using LinearColor = std::array<Plane, 3>;

LinearColor linear_color(const Rgb8Image& frame);

}  // namespace organbake
