// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "organbake/warp/pixel_box.h"

namespace organbake {

// The picture cut into tiles whose keys, and the colours that they name, stay in a core's
// second-level cache of a megabyte: in tiles of 256 × 128 a frame's colours are fetched anew from a
// cache that others share, and take half as long again whenever those are busy. A tile belongs to
// one thread from the first splat to the last pixel, so no result depends on the number of threads.
class TileGrid {
 public:
  static constexpr int kWidth = 192, kHeight = 128;

  TileGrid() = default;
  TileGrid(int width, int height)
      : width_(width),
        height_(height),
        columns_((width + kWidth - 1) / kWidth),
        rows_((height + kHeight - 1) / kHeight) {}

  int columns() const { return columns_; }
  int count() const { return columns_ * rows_; }
  PixelBox box(int tile) const {
    const int x = tile % columns_ * kWidth, y = tile / columns_ * kHeight;
    return {x, y, x + kWidth < width_ ? x + kWidth : width_,
            y + kHeight < height_ ? y + kHeight : height_};
  }

 private:
  int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
};

// Which items touch which tile, in order of the items.
class TileLists {
 public:
  // box_of(item) is clipped to the picture; empty boxes touch nothing.
  template <class BoxOf>
  void build(const TileGrid& grid, std::uint32_t items, BoxOf&& box_of) {
    start_.assign(grid.count() + 1, 0);
    each(grid, items, box_of, [&](std::uint32_t, int tile) { ++start_[tile + 1]; });
    for (int t = 0; t < grid.count(); ++t) start_[t + 1] += start_[t];
    items_.resize(start_.back());
    next_.assign(start_.begin(), start_.end() - 1);
    each(grid, items, box_of, [&](std::uint32_t item, int tile) { items_[next_[tile]++] = item; });
  }
  std::span<const std::uint32_t> operator[](int tile) const {
    return std::span(items_).subspan(start_[tile], start_[tile + 1] - start_[tile]);
  }

 private:
  template <class BoxOf, class Visit>
  static void each(const TileGrid& grid, std::uint32_t items, BoxOf&& box_of, Visit&& visit) {
    for (std::uint32_t i = 0; i < items; ++i) {
      const PixelBox box = box_of(i);
      if (box.empty()) continue;
      for (int y = box.y0 / TileGrid::kHeight; y <= (box.y1 - 1) / TileGrid::kHeight; ++y) {
        for (int x = box.x0 / TileGrid::kWidth; x <= (box.x1 - 1) / TileGrid::kWidth; ++x) {
          visit(i, y * grid.columns() + x);
        }
      }
    }
  }

  std::vector<std::uint32_t> start_, next_, items_;
};

}  // namespace organbake
