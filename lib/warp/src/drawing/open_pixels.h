// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "drawing/tile_keys.h"
#include "picture/tile_grid.h"

namespace organbake {

// Which pixels of a tile no camera's sample placed on: one bit each, so that whole boxes without
// any are passed over in a few words.
class OpenPixels {
 public:
  void find(const PixelBox& tile, std::span<const TileKeys* const> layers);

  bool at(int x, int y) const {  // of the picture
    const int column = x - tile_.x0;
    return rows_[y - tile_.y0][column / 64] >> (column % 64) & 1;
  }
  // Whether any pixel of the box, clipped to the tile, is open.
  bool any(const PixelBox& box) const;

 private:
  static constexpr int kWords = TileGrid::kWidth / 64;
  static_assert(TileGrid::kWidth % 64 == 0);
  using Row = std::array<std::uint64_t, kWords>;
  static Row bits_between(int first, int last);

  PixelBox tile_;
  std::array<Row, TileGrid::kHeight> rows_;
};

}  // namespace organbake
