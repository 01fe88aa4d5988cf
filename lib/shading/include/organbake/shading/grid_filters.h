// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "organbake/shading/grid.h"
#include "organbake/shading/log_range_fit.h"

namespace organbake {

// Mean over the inside pixels of a square window of 2·radius + 1; where there are none, 0.
[[nodiscard]] Plane box_mean(const Plane& plane, const Mask& inside, int radius);

// dv/di at index i of n values `stride` apart: central, of fourth order where there is room and of
// second order elsewhere (one-sided at the ends).
double derivative_at(const float* v, int i, int n, std::ptrdiff_t stride);

// The same for a whole row at once, per pixel: along it (by x), and across it (by y).
void derivatives_along(const Plane& v, int row, std::vector<double>& by_x);
void derivatives_across(const Plane& v, int row, std::vector<double>& by_y);

// Standard deviation of the noise of neighbouring pixels, from the median response of Immerkær's
// mask (1996), which planes and quadrics do not excite. 0 when fewer than nine pixels lie inside.
[[nodiscard]] double noise_level(const Plane& intensity, const Mask& inside);

// Half the size: means over the inside pixels of 2×2, their variance with them; a pixel is inside
// when any of its four is.
[[nodiscard]] ShadedImage halved(const ShadedImage& fine);
// A mean over a pixel of `halvings` levels up made into the value at its centre (the mean is off by
// h²/24 · ∇²I, which a coarse grid would take for shape).
[[nodiscard]] Plane centre_values(const Plane& means, const Mask& inside, int halvings);
// Means over 2×2, and back by bilinear interpolation (extrapolated by half a pixel at the border).
[[nodiscard]] Plane halved(const Plane& fine);
[[nodiscard]] Plane doubled(const Plane& coarse, int width, int height);

// Gives the pixels outside the mask a smooth continuation of those inside (push–pull; Gortler et
// al. 1996). Without any inside pixel all become 0.
void fill_outside(Plane& plane, const Mask& inside);

}  // namespace organbake
