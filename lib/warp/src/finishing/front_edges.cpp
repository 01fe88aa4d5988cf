// SPDX-License-Identifier: Apache-2.0
#include "finishing/front_edges.h"

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include <algorithm>
#include <cmath>
#include <utility>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using Level = SkinDepth::Level;
constexpr int kEdgeWord = CoverMask::kWord;
constexpr int kEdgeGrain = 32;  // rows of a piece

// One bit for each of 64 pairs of levels that are more than `deeper` apart. The compiler makes
// bytes of bits, one by one.
std::uint64_t apart(const Level* levels, const Level* others, Level most) {
#if defined(__AVX2__)
  const __m256i deeper = _mm256_set1_epi16(static_cast<short>(most));
  const auto far_apart = [&](int i) {
    const auto at = [i](const Level* from) {
      return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from + i));
    };
    const __m256i a = at(levels), b = at(others);
    const __m256i difference = _mm256_or_si256(_mm256_subs_epu16(a, b), _mm256_subs_epu16(b, a));
    return _mm256_cmpeq_epi16(_mm256_subs_epu16(difference, deeper), _mm256_setzero_si256());
  };
  std::uint64_t near = 0;
  for (int i = 0; i < kEdgeWord; i += 32) {
    const __m256i bytes = _mm256_packs_epi16(far_apart(i), far_apart(i + 16));
    const auto bits = static_cast<std::uint32_t>(
        _mm256_movemask_epi8(_mm256_permute4x64_epi64(bytes, 0b11011000)));
    near |= std::uint64_t{bits} << i;
  }
  return ~near;
#elif defined(__wasm_simd128__)
  const v128_t deeper = wasm_i16x8_splat(static_cast<std::int16_t>(most));
  const auto far_apart = [&](int i) {
    const v128_t a = wasm_v128_load(levels + i), b = wasm_v128_load(others + i);
    const v128_t difference = wasm_v128_or(wasm_u16x8_sub_sat(a, b), wasm_u16x8_sub_sat(b, a));
    return wasm_u16x8_gt(difference, deeper);
  };
  std::uint64_t far = 0;
  for (int i = 0; i < kEdgeWord; i += 16) {
    const v128_t bytes = wasm_i8x16_narrow_i16x8(far_apart(i), far_apart(i + 8));
    far |= std::uint64_t{wasm_i8x16_bitmask(bytes)} << i;
  }
  return far;
#else
  std::uint64_t far = 0;
  for (int i = 0; i < kEdgeWord; ++i)
    far |= std::uint64_t{std::abs(int{levels[i]} - int{others[i]}) > int{most}} << i;
  return far;
#endif
}

// Levels along a line of four pixels, the pair in the middle. Whether one surface ends between
// them: a slope goes on at least on one side.
bool is_step(int before, int first, int second, int after) {
  if (first > second) std::swap(before, after), std::swap(first, second);
  // One pixel of the farther surface before the background does not tell: mostly it is the last of
  // the nearer one.
  if (second == SkinDepth::kNothing || after == SkinDepth::kNothing) return false;
  const int step = second - first, back = std::abs(after - second);
  const int front = before == SkinDepth::kNothing ? 0 : std::abs(first - before);
  // Towards its own outline the nearer surface falls ever faster; what lies behind does not.
  constexpr int kBack = 3;
  return step > front && step > kBack * back;
}

}  // namespace

void FrontEdges::find(const CoverMask& skin) {
  find_rows(skin, [](int) {});
}

void FrontEdges::find(const CoverMask& skin, const SkinDepth& depth, float deeper_mm) {
  const float levels = std::min(deeper_mm / depth.level_mm(), float{SkinDepth::kFarthest});
  const auto deeper = static_cast<Level>(std::max(1L, std::lround(levels)));
  find_rows(skin, [&](int y) {
    find_steps(depth, deeper, row, y);
    if (y + 1 < skin.box().y1) find_steps(depth, deeper, column, y);
  });
}

// Each row has bits of its own; add_steps(y) adds to them.
template <class AddSteps>
void FrontEdges::find_rows(const CoverMask& skin, const AddSteps& add_steps) {
  skin_ = &skin;
  const PixelBox& box = skin.box();
  const std::size_t words = skin.words(), all = words * std::max(0, box.height());
  for (auto& planes : planes_)
    for (auto& plane : planes) plane.resize(all);
  parallel_pieces(box.y0, box.y1, kEdgeGrain, [&](int y, int last) {
    for (; y < last; ++y) {
      find_borders(y);
      add_steps(y);
    }
  });
}

// Of the background.
void FrontEdges::find_borders(int y) {
  const CoverMask& skin = *skin_;
  const std::size_t at = std::size_t(y - skin.box().y0) * skin.words();
  const bool last = y + 1 == skin.box().y1;
  for (int word = 0; word < skin.words(); ++word) {
    const std::uint64_t here = skin.skin(y)[word], open = skin.open(y)[word];
    planes_[row][first][at + word] = here & skin.left_of(skin.open(y), word);
    planes_[row][second][at + word] = open & skin.left_of(skin.skin(y), word);
    planes_[column][first][at + word] = last ? 0 : here & skin.open(y + 1)[word];
    planes_[column][second][at + word] = last ? 0 : open & skin.skin(y + 1)[word];
  }
}

void FrontEdges::find_steps(const SkinDepth& depth, Level deeper, Along along, int y) {
  const PixelBox& box = skin_->box();
  const std::size_t at = std::size_t(y - box.y0) * skin_->words();
  // Along the line on which the pair lies: the pixels before, of and after it.
  const auto levels = [&](int i) {
    return (along == row ? depth.row(y) + i : depth.row(y + i)) + box.x0;
  };
  const std::array line = {levels(-1), levels(0), levels(1), levels(2)};
  for (int word = 0; word < skin_->words(); ++word) {
    const std::uint64_t* const here = skin_->skin(y);
    const std::uint64_t both =
        here[word] & (along == row ? skin_->left_of(here, word) : skin_->skin(y + 1)[word]);
    if (both == 0) continue;
    const int x0 = word * kEdgeWord;
    for (std::uint64_t bits = both & apart(line[1] + x0, line[2] + x0, deeper); bits != 0;
         bits &= bits - 1) {
      const int bit = std::countr_zero(bits), x = x0 + bit;
      if (!is_step(line[0][x], line[1][x], line[2][x], line[3][x])) continue;
      planes_[along][line[1][x] < line[2][x] ? first : second][at + word] |= std::uint64_t{1}
                                                                             << bit;
    }
  }
}

bool FrontEdges::in_front(PixelAt pixel, PixelAt other) const {
  const Along along = pixel.y == other.y ? row : column;
  return other.x > pixel.x || other.y > pixel.y ? has(along, first, pixel)
                                                : has(along, second, other);
}

}  // namespace organbake
