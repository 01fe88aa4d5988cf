// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/geometry/camera.h"

namespace organbake {

// Of a fisheye's picture this much is straightened: beyond, pixels of a pinhole are drawn out to
// several times their size.
inline constexpr double kWidestPinhole_rad = 2.0943951023931953;  // 120°

// Angle between the rays at the middle of the picture's left and right side.
double angle_across_rad(const Intrinsics& lens);

// The camera without distortion whose picture stands for that of `lens` when its distortion is
// undone, of the same size and principal point. Brown's: of the same focal lengths. A fisheye's:
// the focal length at which each side shows what the fisheye has there, or 60° from the axis.
Intrinsics pinhole_of(const Intrinsics& lens);

// The lens of the same picture at another size. Halved sizes may have lost an odd row or column:
// they are halved exactly.
Intrinsics scaled_lens(const Intrinsics& lens, int width, int height);

// Whether a picture of this size is the lens's at another size, but for pixels that halving loses.
bool is_scaled_picture(const Intrinsics& lens, int width, int height);

}  // namespace organbake
