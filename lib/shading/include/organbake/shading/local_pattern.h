// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// What pictures of one piece of tissue have in common, to be matched.

// Grey levels as coded, 0…255 (ITU-R BT.601's weights).
Plane grey_levels(const Rgb8Image& color);

// Brightness against its surroundings (a square of 21 pixels), in standard deviations of them: the
// lamp's fall-off and unlike gains are gone, and what is no stronger than a level of noise stays
// weak. 0 where nothing counts.
Plane local_pattern(const Plane& grey, const Mask& counts);

// Means of 2×2 of what counts; a pixel counts when most of it does. An odd last row or column falls
// away.
void halve_counted(Plane& grey, Mask& counts);

}  // namespace organbake
