// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// What lies off the distance that a lens is focused on becomes a disc of so many pixels across,
//   focal_px · aperture_mm · |1 / z − 1 / z₀|   (a thin lens),
// here a Gaussian as wide. z₀ is the median depth amid the picture, as a camera focuses; depth_mm
// is planar, +inf where nothing is. Nothing happens where the middle shows nothing.
void blur_out_of_focus(double aperture_mm, double focal_px, const std::vector<float>& depth_mm,
                       Rgb8Image& picture);

}  // namespace organbake
