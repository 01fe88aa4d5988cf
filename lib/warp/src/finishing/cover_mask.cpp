// SPDX-License-Identifier: Apache-2.0
#include "finishing/cover_mask.h"

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr int kWord = CoverMask::kWord;
constexpr int kRowGrain = 64;  // rows of a piece

// One bit for each of 64 covers that are `wanted`. The compiler makes bytes of bits, one by one.
std::uint64_t bits_of(const Cover* covers, Cover wanted) {
#if defined(__AVX2__)
  const __m256i sought = _mm256_set1_epi8(static_cast<char>(wanted));
  const auto half = [&](const Cover* from) {
    const __m256i lanes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
    return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(lanes, sought)));
  };
  return half(covers) | std::uint64_t{half(covers + kWord / 2)} << (kWord / 2);
#elif defined(__wasm_simd128__)
  const v128_t sought = wasm_i8x16_splat(static_cast<std::int8_t>(wanted));
  std::uint64_t bits = 0;
  for (int first = 0; first < kWord; first += 16) {
    const v128_t alike = wasm_i8x16_eq(wasm_v128_load(covers + first), sought);
    bits |= std::uint64_t{wasm_i8x16_bitmask(alike)} << first;
  }
  return bits;
#else
  std::uint64_t bits = 0;
  for (int i = 0; i < kWord; ++i) bits |= std::uint64_t{covers[i] == wanted} << i;
  return bits;
#endif
}

// Calls visit(covers) for each 64 covers of a box's row; of the last, those outside are `beyond`.
template <class Visit>
void for_each_word(const Frame& frame, const PixelBox& box, int y, Cover beyond,
                   const Visit& visit) {
  const Cover* row = &frame.cover[std::size_t(y) * frame.color.width + box.x0];
  int x = 0;
  for (; x + kWord <= box.width(); x += kWord) visit(row + x);
  if (x == box.width()) return;
  std::array<Cover, kWord> last;
  last.fill(beyond);
  std::copy_n(row + x, box.width() - x, last.begin());
  visit(last.data());
}

}  // namespace

void CoverMask::read(const PixelBox& box, const Frame& frame) {
  box_ = box;
  words_ = (box.width() + kWord - 1) / kWord;
  const std::size_t words = std::size_t(words_) * std::max(0, box.height());
  skin_.resize(words);
  open_.resize(words);
  parallel_pieces(box.y0, box.y1, kRowGrain, [&](int y, int last) {
    std::size_t at = std::size_t(y - box.y0) * words_;
    // Beyond the box: tools, which are neither skin nor open.
    for (; y < last; ++y) {
      for_each_word(frame, box, y, Cover::solid, [&](const Cover* covers) {
        const std::uint64_t open = bits_of(covers, Cover::background);
        open_[at] = open;
        skin_[at++] = ~(open | bits_of(covers, Cover::solid));
      });
    }
  });
}

void CoverMask::read_with_border(const PixelBox& box, const Frame& frame) {
  const PixelBox picture{0, 0, frame.color.width, frame.color.height};
  if (box.empty()) return read({}, frame);
  read(intersected({box.x0 - 1, box.y0 - 1, box.x1 + 1, box.y1 + 1}, picture), frame);
}

std::size_t count_cover(const Frame& frame, const PixelBox& box, Cover wanted) {
  const Cover other = wanted == Cover::solid ? Cover::background : Cover::solid;
  std::atomic<std::size_t> count = 0;
  if (box.empty()) return count;
  parallel_pieces(box.y0, box.y1, kRowGrain, [&](int y, int last) {
    std::size_t of_piece = 0;
    for (; y < last; ++y) {
      for_each_word(frame, box, y, other, [&](const Cover* covers) {
        of_piece += static_cast<std::size_t>(std::popcount(bits_of(covers, wanted)));
      });
    }
    count += of_piece;
  });
  return count;
}

}  // namespace organbake
