// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "light/linear_color.h"

namespace organbake {

// A frame's colours by the light that fell on each pixel (1 = as much as at the reference; 0 = no
// tissue, which becomes black), as far as the frame's noise allows: what a division makes louder is
// first quieted across edges of its own colour, and where noise would still be seen the division is
// damped to light / (light² + ε²), as Wiener's filter does. `counts`: pixels that noise is read
// from.
LinearColor divided_by_light(const Rgb8Image& frame, const Plane& light, const Mask& counts);

}  // namespace organbake
