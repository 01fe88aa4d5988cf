// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/masks.h"

#include <algorithm>

namespace organbake {
namespace {

constexpr int kBlack = 16;  // of the brightest channel: what coding leaves of a black border

}  // namespace

Mask field_of_view(const Rgb8Image& frame, int margin_px) {
  Mask lit(frame.width, frame.height);
  std::size_t dark = 0;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      const std::uint8_t* p = frame.at(x, y);
      lit.at(x, y) = std::max({p[0], p[1], p[2]}) > kBlack;
      dark += !lit.at(x, y);
    }
  if (dark == lit.size() || dark == 0) return lit;
  const Mask inside = with_holes_closed(largest_region(lit));
  // The frame's own edge is no stop: only the inner border shrinks.
  return eroded(inside, margin_px);
}

}  // namespace organbake
