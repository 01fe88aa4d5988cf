// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "shading/log_range_fit.h"

namespace organbake {

// Half the size: means over the inside pixels of 2×2, their variance with them; a pixel is inside
// when any of its four is.
ShadedImage halved(const ShadedImage& fine);
// A mean over a pixel of `halvings` levels up made into the value at its centre (the mean is off by
// h²/24 · ∇²I, which a coarse grid would take for shape).
Plane centre_values(const Plane& means, const Mask& inside, int halvings);
// Means over 2×2, and back by bilinear interpolation (extrapolated by half a pixel at the border).
Plane halved(const Plane& fine);
Plane doubled(const Plane& coarse, int width, int height);

// Gives the pixels outside the mask a smooth continuation of those inside (push–pull; Gortler et
// al. 1996). Without any inside pixel all become 0.
void fill_outside(Plane& plane, const Mask& inside);

}  // namespace organbake
