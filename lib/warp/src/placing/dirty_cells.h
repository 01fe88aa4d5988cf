// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "organbake/warp/pixel_box.h"

namespace organbake {

// Which parts of the last frame, of the same view, have to be drawn again: those that something
// that moved touches where it was or where it is now. In cells much smaller than tiles.
class DirtyCells {
 public:
  static constexpr int kCell_px = 16;

  void reset(int width, int height, bool all) {
    columns_ = (width + kCell_px - 1) / kCell_px;
    moved_.assign(std::size_t(columns_) * ((height + kCell_px - 1) / kCell_px), all);
  }
  // box: clipped to the picture. From any thread.
  void mark(const PixelBox& box) {
    each(box, [&](int, int, std::uint8_t& cell) {
      // As std::atomic_ref, which not every standard library has yet.
      __atomic_store_n(&cell, std::uint8_t{1}, __ATOMIC_RELAXED);
    });
  }
  // Round all moved cells within `tile`.
  PixelBox within(const PixelBox& tile) {
    PixelBox moved;
    each(tile, [&](int x, int y, std::uint8_t& cell) {
      if (cell) moved = united(moved, {x, y, x + kCell_px, y + kCell_px});
    });
    return intersected(moved, tile);
  }

 private:
  template <class Visit>
  void each(const PixelBox& box, Visit&& visit) {
    if (box.empty()) return;
    for (int y = box.y0 / kCell_px; y <= (box.y1 - 1) / kCell_px; ++y) {
      for (int x = box.x0 / kCell_px; x <= (box.x1 - 1) / kCell_px; ++x) {
        visit(x * kCell_px, y * kCell_px, moved_[std::size_t(y) * columns_ + x]);
      }
    }
  }

  int columns_ = 0;
  std::vector<std::uint8_t> moved_;
};

}  // namespace organbake
