// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/image/channel_image.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {

// Colours that were found at a reduced frame's size (`color`, sRGB, as divide_light_out() gives
// them), in the pixels of the frame before it was halved so many times: with that frame's detail
// wherever the reduced one is diffuse tissue. `frame` is undistorted as the reduced one is. Throws
// BadDataError when `color` is not of the reduced frame's size.
[[nodiscard]] Rgb8Image with_own_pixels(const Rgb8Image& color, const PreparedFrame& reduced,
                                        const Rgb8Image& frame, int halvings);

}  // namespace organbake
