// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/warp/view.h"

// For plain loops that carry a frame: compiled a second time for AVX-512, and chosen when the
// program is loaded, a sixteenth of a frame. Both give the same bits: the arithmetic is the same
// lane by lane, fused multiply-adds included. Sanitizers are not ready yet when it is chosen.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__) || \
    !defined(__AVX2__)
#define ORGANBAKE_MULTIVERSION
#else
#define ORGANBAKE_MULTIVERSION __attribute__((target_clones("default", "arch=x86-64-v4")))
#endif

// Before a loop whose numbers are not all of one width: clang counts a vector's lanes by the
// widest, and of vectors of 128 bits two or four are left where the most of the work would take
// twice that.
#if defined(__wasm_simd128__)
#define ORGANBAKE_LANES_PRAGMA(text) _Pragma(#text)
#define ORGANBAKE_LANES(count) ORGANBAKE_LANES_PRAGMA(clang loop vectorize_width(count))
#else
#define ORGANBAKE_LANES(count)
#endif

// Before a loop none of whose steps reads what another writes: g++ gives up on a loop that would
// need more than ten checks of that at run time, as those over many planes would, and takes number
// by number. (clang's word for it demands the vectors, and warns where it makes none.)
#if defined(__clang__)
#define ORGANBAKE_INDEPENDENT
#else
#define ORGANBAKE_INDEPENDENT _Pragma("GCC ivdep")
#endif

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

// Such loops run over whole vectors of the widest kind: what lies beyond the last number is worked
// out, too, and its result is never read. A remainder is a loop of its own, number by number: as
// dear as the rest where a chunk or a row is as short as ours.
inline constexpr unsigned kLanes = 16;
constexpr unsigned whole_vectors(int count) {
  return (static_cast<unsigned>(count) + kLanes - 1) & ~(kLanes - 1);
}

// Pixels at a time. A span's planes and what it reads then stay in the first-level cache, which
// those of a tile's whole row don't.
inline constexpr int kSpan = 128;
static_assert(kSpan % kLanes == 0);
// Rows that are lit together: what light depends on is asked for at some of their pixels.
inline constexpr int kSpanRows = RowSpans::kRows;
inline constexpr float kFullScale = 255.0f * 255.0f;  // square-root light squared

// A span of a tile's row while it is summed: colour × weight in 0…255², the weight, and the
// depth of the nearest skin (mm), and of that without the base layer, where there is one.
struct SumSpan {
  alignas(64) float red[kSpan], green[kSpan], blue[kSpan], weight[kSpan];
  alignas(64) float nearest[kSpan], nearest_sample[kSpan];
};

// Sums to sRGB bytes; background where nothing weighs.
void encode(const SumSpan& sum, int count, const std::array<std::uint8_t, 3>& background,
            std::uint8_t* __restrict rgb, Cover* __restrict cover);

// Depth of the skin that each pixel of a picture shows, and nothing round the picture, so that
// whoever looks at a pixel's neighbours need not ask whether they exist. In 65,535 levels: they
// tell skin from the skin behind it, which needs no more, and a picture's depths are written and
// read in every frame, which half the bytes make faster.
class SkinDepth {
 public:
  using Level = std::uint16_t;
  static constexpr Level kNothing = 0xFFFF, kFarthest = 0xFFFE;
  static constexpr int kMargin = 2;  // rows, and columns, that can be asked beyond each border

  // Skin from reach_mm on has the same level. A change of size forgets all; after a change of reach
  // all has to be put anew.
  void resize(int width, int height, float reach_mm);
  // Of a whole picture's depths, with a reach to the farthest skin, and so far at least.
  static SkinDepth of(const std::vector<float>& depth_mm, int width, float reach_mm);
  int width() const { return width_; }
  int height() const { return height_; }
  Level levels(float mm) const {  // that so many come to
    return static_cast<Level>(std::lround(std::min(mm / level_mm_, float{kFarthest})));
  }
  const Level* row(int y) const { return levels_.data() + first_of(y); }
  // Depths of pixels from (x, y) on along a row, to be read up to whole vectors; +inf: no skin.
  void put(int x, int y, int count, const float* depth_mm);
  void clear(const PixelBox& box) {
    for (int y = box.y0; y < box.y1; ++y) std::fill(at(box.x0, y), at(box.x1, y), kNothing);
  }

 private:
  // Beyond a row whole vectors can be read, of twice as many levels as other numbers.
  static constexpr int kAside = kMargin + 2 * static_cast<int>(kLanes);
  int stride() const { return width_ + 2 * kAside; }
  std::size_t first_of(int y) const { return std::size_t(stride()) * (y + kMargin) + kAside; }
  Level* at(int x, int y) { return levels_.data() + first_of(y) + x; }

  int width_ = 0, height_ = 0;
  float level_mm_ = 1;
  std::vector<Level> levels_;
};

}  // namespace organbake
