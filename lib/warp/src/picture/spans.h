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
#include <vector>

#include "organbake/warp/frame.h"
#include "picture/tiles.h"

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
