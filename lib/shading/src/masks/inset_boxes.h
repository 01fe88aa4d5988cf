// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A rectangle of pixels; ends are one beyond.
struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;
  double area() const { return double(right - left) * (bottom - top); }
};

// Rectangles whose sides are seams in most of these frames of a clip (of one size), or the frame's
// own border, or outside of the field of view; without what may be the scope's own picture. At most
// four, the surest first; they lie apart or within each other.
std::vector<Box> boxes_of_seams(const std::vector<Rgb8Image>& frames, const Mask& field);

}  // namespace organbake
