// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "finishing/cover_mask.h"
#include "organbake/warp/frame.h"

namespace organbake {

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
