// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "finishing/cover_mask.h"
#include "organbake/warp/frame.h"

namespace organbake {

// A slit is a run of at most this many uncovered pixels between skin, down a column or along a row,
// before tools are drawn: what opens between two terraces of a CT's slices when they are seen more
// from the side than any camera saw them. Longer runs may be the gap between two lobes.
inline constexpr int kWidestSlit = 4;

// Counts the pixels of all slits in the box of `bits`, which tell the frame's skin, and, with
// `fill`, gives each the colour between its two ends, in the frame and the bits. Columns go first,
// rows take what is left.
std::size_t fill_slits(CoverMask& bits, bool fill, Frame& frame);

}  // namespace organbake
