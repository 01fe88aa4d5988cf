// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <immintrin.h>

#include <array>
#include <bit>
#include <cstdint>

namespace organbake {

// Moves those of eight lanes whose bit is set in a mask to the front, in their order: what follows
// then works on them alone, without a branch each that nobody can predict. The compiler has no loop
// for it.
class LeftPack {
 public:
  explicit LeftPack(unsigned mask)
      : order_(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(kOrders[mask]))),
        count_(std::popcount(mask)) {}

  int count() const { return count_; }
  // Each writes all eight lanes; those after count() are to be overwritten.
  template <class Number>
  void operator()(const Number* from, Number* to) const {
    static_assert(sizeof(Number) == 4);
    store(_mm256_permutevar8x32_epi32(load(from), order_), to);
  }
  // Low and high halves to whole numbers.
  void operator()(const std::uint32_t* low, const std::uint32_t* high, std::uint64_t* to) const {
    // Unpacking takes half of each half of a vector: the quarters are set out for it.
    const __m256i order = _mm256_permute4x64_epi64(order_, 0b11'01'10'00);
    const __m256i lows = _mm256_permutevar8x32_epi32(load(low), order);
    const __m256i highs = _mm256_permutevar8x32_epi32(load(high), order);
    store(_mm256_unpacklo_epi32(lows, highs), to);
    store(_mm256_unpackhi_epi32(lows, highs), to + 4);
  }

 private:
  static __m256i load(const void* from) {
    return _mm256_loadu_si256(static_cast<const __m256i*>(from));
  }
  static void store(__m256i lanes, void* to) {
    _mm256_storeu_si256(static_cast<__m256i*>(to), lanes);
  }

  // By mask: the numbers of its set bits, one a byte.
  static constexpr std::array<std::int64_t, 256> kOrders = [] {
    std::array<std::int64_t, 256> orders{};
    for (unsigned mask = 0; mask < 256; ++mask) {
      int place = 0;
      for (std::int64_t bit = 0; bit < 8; ++bit) {
        if (mask >> bit & 1) orders[mask] |= bit << (8 * place++);
      }
    }
    return orders;
  }();

  __m256i order_;
  int count_;
};

// One bit for each of eight numbers that is not `value`.
inline unsigned lanes_unlike(const std::uint32_t* numbers, std::uint32_t value) {
  const __m256i lanes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(numbers));
  const __m256i alike = _mm256_cmpeq_epi32(lanes, _mm256_set1_epi32(static_cast<int>(value)));
  return 255u & ~static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(alike)));
}

// The bits of the first `count` of eight lanes, all of them for more.
inline unsigned first_lanes(int count) { return count < 8 ? (1u << count) - 1 : 255u; }

}  // namespace organbake
