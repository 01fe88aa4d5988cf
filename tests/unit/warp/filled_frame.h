// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "finishing/hole_fill.h"
#include "finishing/slit_fill.h"

namespace organbake {

// fill() of a frame's box by bits read from it, which must tell the frame's skin afterwards, too.
template <class Fill>
auto filled_in(const PixelBox& box, bool really, Frame& frame, Fill&& fill) {
  CoverMask kept, anew;
  kept.read(box, frame);
  const auto result = fill(kept, really, frame);
  anew.read(box, frame);
  EXPECT_EQ(kept, anew);
  return result;
}
inline std::size_t slits_filled_in(const PixelBox& box, bool really, Frame& frame) {
  return filled_in(box, really, frame, fill_slits);
}
inline HoleCounts holes_filled_in(const PixelBox& box, bool really, Frame& frame) {
  return filled_in(box, really, frame, fill_holes);
}

}  // namespace organbake
