// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/shading/frame_depth.h"

namespace organbake {

// Field of view grey, highlights white, instruments blue, the border black.
Rgb8Image mask_picture(const PreparedFrame& frame);
// 0 black … 1 white.
Rgb8Image grey_picture(const Plane& share);
// Frame, mask, depth and relief (lit from above left) beside each other, each at most
// `side` wide.
Rgb8Image frame_strip(const PreparedFrame& frame, const FrameDepth& result, int side);
// One below the other.
Rgb8Image stacked(const std::vector<Rgb8Image>& rows);

}  // namespace organbake
