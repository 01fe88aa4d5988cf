// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "shading/grid.h"

namespace organbake {

// Standard deviation of the noise of neighbouring pixels, from the median response of Immerkær's
// mask (1996), which planes and quadrics do not excite. 0 when fewer than nine pixels lie inside.
double noise_level(const Plane& intensity, const Mask& inside);

}  // namespace organbake
