// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/warp/frame.h"

namespace organbake {

// visit(column, row) for the blocks of so many pixels, counted from pixel 0, that a box touches.
template <class Visit>
void each_block(const PixelBox& box, int width, int height, const Visit& visit) {
  if (box.empty()) return;
  for (int row = box.y0 / height; row <= (box.y1 - 1) / height; ++row)
    for (int column = box.x0 / width; column <= (box.x1 - 1) / width; ++column) visit(column, row);
}

// The picture cut into tiles whose keys, and the colours that they name, stay in a core's
// second-level cache of a megabyte: in tiles of 256 × 128 a frame's colours are fetched anew from a
// cache that others share, and take half as long again whenever those are busy. A tile, or a part
// of it (TilePart), belongs to one thread from the first splat to the last pixel, so no result
// depends on the number of threads.
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
  // box_of(item) is clipped to the picture; empty boxes touch nothing. Pieces of the items are
  // counted, and then listed, at once: a tile's list holds what is of the first piece, then of the
  // second, and so on.
  template <class BoxOf>
  void build(const TileGrid& grid, std::uint32_t items, const BoxOf& box_of) {
    const std::uint32_t pieces = (items + kPiece - 1) / kPiece;
    const std::size_t tiles = grid.count();
    next_.assign(pieces * tiles, 0);
    const auto each_of = [&](std::uint32_t piece, const auto& visit) {
      for (std::uint32_t i = piece * kPiece; i < std::min(items, (piece + 1) * kPiece); ++i)
        each_block(box_of(i), TileGrid::kWidth, TileGrid::kHeight,
                   [&](int x, int y) { visit(i, y * grid.columns() + x); });
    };
    parallel_for(std::uint32_t{0}, pieces, [&](std::uint32_t piece) {
      std::uint32_t* const counts = &next_[piece * tiles];
      each_of(piece, [counts](std::uint32_t, int tile) { ++counts[tile]; });
    });
    start_.assign(tiles + 1, 0);
    std::uint32_t listed = 0;
    for (std::size_t tile = 0; tile < tiles; ++tile) {
      for (std::uint32_t piece = 0; piece < pieces; ++piece)
        listed += std::exchange(next_[piece * tiles + tile], listed);
      start_[tile + 1] = listed;
    }
    items_.resize(listed);
    parallel_for(std::uint32_t{0}, pieces, [&](std::uint32_t piece) {
      std::uint32_t* const next = &next_[piece * tiles];
      each_of(piece, [this, next](std::uint32_t item, int tile) { items_[next[tile]++] = item; });
    });
  }
  std::span<const std::uint32_t> operator[](int tile) const {
    return std::span(items_).subspan(start_[tile], start_[tile + 1] - start_[tile]);
  }

 private:
  static constexpr std::uint32_t kPiece = 2048;  // items

  std::vector<std::uint32_t> start_, items_;
  std::vector<std::uint32_t> next_;  // by piece and tile: where its next item goes
};

// Which columns of a tile's rows anything may have been drawn to: a convex guess for each few rows,
// cheap to keep and enough to pass over what lies outside a silhouette.
class RowSpans {
 public:
  static constexpr int kRows = 4;
  static_assert(TileGrid::kHeight % kRows == 0);

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
  PixelBox tile_;
  std::array<int, TileGrid::kHeight / kRows> first_, last_;
};

// Adds the work since the last lap to a phase, and its longest chain to another, when asked to
// measure at all.
class PhaseClock {
 public:
  explicit PhaseClock(bool measure) {
    if (measure) meter_.emplace();
  }
  WorkSpan lap() { return meter_ ? meter_->lap() : WorkSpan(); }
  void lap(double& work_ms) { work_ms += lap().work_ms; }
  void lap(double& work_ms, double& span_ms) {
    const WorkSpan since = lap();
    work_ms += since.work_ms;
    span_ms += since.span_ms;
  }

 private:
  std::optional<WorkMeter> meter_;
};

}  // namespace organbake
