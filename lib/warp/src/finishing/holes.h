// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/warp/cover_mask.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/pixel_box.h"
#include "organbake/warp/skin_depth.h"

namespace organbake {

// Between two terraces of a CT's slices, seen more from the side than any camera saw them, single
// pixels look through the skin at whatever lies behind. A covered pixel that lies deeper_mm behind
// the nearer of two pixels on either side, along its row or its column, is one: made background,
// the slits' and holes' filling closes it. `depth` is looked at in the box and round it. Returns
// the pixels' numbers in the picture, ascending.
std::vector<std::uint32_t> find_see_through(const PixelBox& box, const SkinDepth& depth,
                                            float deeper_mm);

// A slit is a run of at most this many uncovered pixels between skin, down a column or along a row,
// before tools are drawn: what opens between two terraces of a CT's slices when they are seen more
// from the side than any camera saw them. Longer runs may be the gap between two lobes.
inline constexpr int kWidestSlit = 4;

// Counts the pixels of all slits in the box of `bits`, which tell the frame's skin, and, with
// `fill`, gives each the colour between its two ends, in the frame and the bits. Columns go first,
// rows take what is left.
std::size_t fill_slits(CoverMask& bits, bool fill, Frame& frame);

struct HoleCounts {
  std::size_t before = 0;  // open pixels among covered ones
  std::size_t after = 0;   // still open after filling
};

// A hole is an uncovered pixel of which at least five of the eight neighbours are covered: inside a
// silhouette, not outside a straight or convex one; before tools are drawn. Holes get the mean of
// their covered neighbours, in at most kFillRounds rounds, each from the round before it only.
// `bits` tell the skin of the frame's box that is looked at, and are kept true.
inline constexpr int kFillRounds = 4;
HoleCounts fill_holes(CoverMask& bits, bool fill, Frame& frame);

}  // namespace organbake
