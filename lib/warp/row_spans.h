// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include "warp/pixel_box.h"
#include "warp/tile_grid.h"

namespace organbake {

// Which columns of a tile's rows anything may have been drawn to: a convex guess per row, cheap to
// keep and enough to pass over what lies outside a silhouette.
class RowSpans {
 public:
  void clear(const PixelBox& tile) {
    tile_ = tile;
    first_.fill(TileGrid::kWidth);
    last_.fill(0);
  }
  void add(const PixelBox& drawn) {
    const int x0 = std::max(drawn.x0, tile_.x0) - tile_.x0;
    const int x1 = std::min(drawn.x1, tile_.x1) - tile_.x0;
    const int y1 = std::min(drawn.y1, tile_.y1) - tile_.y0;
    for (int y = std::max(drawn.y0, tile_.y0) - tile_.y0; y < y1; ++y) {
      first_[y] = std::min(first_[y], x0);
      last_[y] = std::max(last_[y], x1);
    }
  }
  void add(const RowSpans& other) {
    for (int y = 0; y < TileGrid::kHeight; ++y) {
      first_[y] = std::min(first_[y], other.first_[y]);
      last_[y] = std::max(last_[y], other.last_[y]);
    }
  }
  // Columns and rows are counted from the tile's corner; empty when first ≥ last.
  int first(int row) const { return first_[row]; }
  int last(int row) const { return last_[row]; }

 private:
  PixelBox tile_;
  std::array<int, TileGrid::kHeight> first_, last_;
};

}  // namespace organbake
