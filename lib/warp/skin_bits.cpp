// SPDX-License-Identifier: Apache-2.0
#include "warp/skin_bits.h"

#include <immintrin.h>

#include <algorithm>
#include <array>

namespace organbake {
namespace {

constexpr int kWord = SkinBits::kWord;

// One bit for each of 64 covers that are `wanted`. The compiler makes bytes of bits, one by one.
std::uint64_t bits_of(const Cover* covers, Cover wanted) {
  const __m256i sought = _mm256_set1_epi8(static_cast<char>(wanted));
  const auto half = [&](const Cover* from) {
    const __m256i lanes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
    return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(lanes, sought)));
  };
  return half(covers) | std::uint64_t{half(covers + kWord / 2)} << (kWord / 2);
}

}  // namespace

void SkinBits::read(const PixelBox& box, const Frame& frame) {
  box_ = box;
  words_ = (box.width() + kWord - 1) / kWord;
  skin_.clear();
  open_.clear();
  for (int y = box.y0; y < box.y1; ++y) {
    const Cover* row = &frame.cover[std::size_t(y) * frame.color.width + box.x0];
    for (int x = 0; x < box.width(); x += kWord) {
      const int count = std::min(kWord, box.width() - x);
      std::array<Cover, kWord> last;  // tools, as nothing else is neither
      if (count < kWord) {
        last.fill(Cover::solid);
        std::copy_n(row + x, count, last.begin());
      }
      const Cover* covers = count < kWord ? last.data() : row + x;
      const std::uint64_t open = bits_of(covers, Cover::background);
      open_.push_back(open);
      skin_.push_back(~(open | bits_of(covers, Cover::solid)));
    }
  }
}

}  // namespace organbake
