// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include "organbake/warp/pixel_box.h"
#include "picture/tile_grid.h"

namespace organbake {

// Which columns of a tile's rows anything may have been drawn to: a convex guess for each few rows,
// cheap to keep and enough to pass over what lies outside a silhouette.
class RowSpans {
 public:
  void clear(const PixelBox& tile) {
    tile_ = tile;
    first_.fill(TileGrid::kWidth);
    last_.fill(0);
  }
  void add(const PixelBox& drawn) {
    const PixelBox part = intersected(drawn, tile_);
    if (part.empty()) return;
    const int end = (part.y1 - 1 - tile_.y0) / kRows;
    for (int band = (part.y0 - tile_.y0) / kRows; band <= end; ++band) {
      first_[band] = std::min(first_[band], part.x0 - tile_.x0);
      last_[band] = std::max(last_[band], part.x1 - tile_.x0);
    }
  }
  void add(const RowSpans& other) {
    for (std::size_t band = 0; band < first_.size(); ++band) {
      first_[band] = std::min(first_[band], other.first_[band]);
      last_[band] = std::max(last_[band], other.last_[band]);
    }
  }
  // Columns and rows are counted from the tile's corner; empty when first ≥ last.
  int first(int row) const { return first_[row / kRows]; }
  int last(int row) const { return last_[row / kRows]; }

 private:
  static constexpr int kRows = 4;
  static_assert(TileGrid::kHeight % kRows == 0);

  PixelBox tile_;
  std::array<int, TileGrid::kHeight / kRows> first_, last_;
};

}  // namespace organbake
