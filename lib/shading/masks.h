// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "shading/grid.h"

namespace organbake {

// Shrinks (grows) what is non-zero by a square of 2·radius + 1 pixels; the frame's edge is no edge.
Mask eroded(const Mask& mask, int radius);
Mask dilated(const Mask& mask, int radius);

// Pixels of both; of one and not of the other.
Mask common(Mask a, const Mask& b);
Mask without(Mask a, const Mask& b);

// The largest 4-connected region of non-zero pixels, as ones.
Mask largest_region(const Mask& mask);
// Zeros that are not 4-connected to the frame's edge become ones.
Mask with_holes_closed(const Mask& mask);
// The 4-connected regions of `mask` that hold a pixel of `seeds`.
Mask regions_touching(const Mask& mask, const Mask& seeds);

}  // namespace organbake
