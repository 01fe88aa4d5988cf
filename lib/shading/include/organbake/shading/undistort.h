// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// What a camera without distortion (geometry/camera.h) would have seen in the place of `lens`,
// bilinear, a mask by its nearest pixels; what was outside the picture is black, or 0. Picture and
// lens are of one size.
[[nodiscard]] Rgb8Image undistorted(const Rgb8Image& picture, const Intrinsics& lens,
                                    const Intrinsics& pinhole);
[[nodiscard]] Plane undistorted(const Plane& plane, const Intrinsics& lens,
                                const Intrinsics& pinhole);
[[nodiscard]] Mask undistorted(const Mask& mask, const Intrinsics& lens, const Intrinsics& pinhole);

// What to say of a lens of which a part alone is used, a fisheye; "" for others.
std::string told_of_fisheye(const Intrinsics& lens);

}  // namespace organbake
