// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include <array>
#include <bit>
#include <cstdint>

namespace organbake {

// Compaction moves those of eight lanes whose bit is set in a mask to the front, in their order:
// what follows then works on them alone, without a branch each that nobody can predict. The
// compiler has no loop for it. Each call writes all eight lanes; those after count() are to be
// overwritten. lanes_unlike() makes such a mask: one bit for each of eight numbers that is not
// `value`.

#if defined(__AVX2__)

class Compaction {
 public:
  explicit Compaction(unsigned mask)
      : order_(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(kOrders[mask]))),
        count_(std::popcount(mask)) {}

  int count() const { return count_; }
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

inline unsigned lanes_unlike(const std::uint32_t* numbers, std::uint32_t value) {
  const __m256i lanes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(numbers));
  const __m256i alike = _mm256_cmpeq_epi32(lanes, _mm256_set1_epi32(static_cast<int>(value)));
  return 255u & ~static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(alike)));
}

#elif defined(__wasm_simd128__)

class Compaction {
 public:
  explicit Compaction(unsigned mask)
      : low_(wasm_v128_load(kOrders[mask & 15].data())),
        high_(wasm_v128_load(kOrders[mask >> 4].data())),
        low_count_(std::popcount(mask & 15)),
        count_(std::popcount(mask)) {}

  int count() const { return count_; }
  template <class Number>
  void operator()(const Number* from, Number* to) const {
    static_assert(sizeof(Number) == 4);
    const v128_t low = wasm_v128_load(from), high = wasm_v128_load(from + 4);
    wasm_v128_store(to, wasm_i8x16_swizzle(low, low_));
    wasm_v128_store(to + low_count_, wasm_i8x16_swizzle(high, high_));
  }
  void operator()(const std::uint32_t* low, const std::uint32_t* high, std::uint64_t* to) const {
    join(wasm_v128_load(low), wasm_v128_load(high), low_, to);
    join(wasm_v128_load(low + 4), wasm_v128_load(high + 4), high_, to + low_count_);
  }

 private:
  static void join(v128_t low, v128_t high, v128_t order, std::uint64_t* to) {
    const v128_t lows = wasm_i8x16_swizzle(low, order), highs = wasm_i8x16_swizzle(high, order);
    wasm_v128_store(to, wasm_i32x4_shuffle(lows, highs, 0, 4, 1, 5));
    wasm_v128_store(to + 2, wasm_i32x4_shuffle(lows, highs, 2, 6, 3, 7));
  }

  // By mask of four lanes: the bytes of those whose bit is set.
  static constexpr auto kOrders = [] {
    std::array<std::array<std::uint8_t, 16>, 16> orders{};
    for (unsigned mask = 0; mask < 16; ++mask) {
      unsigned place = 0;
      for (unsigned lane = 0; lane < 4; ++lane) {
        if (!(mask >> lane & 1)) continue;
        for (unsigned byte = 0; byte < 4; ++byte)
          orders[mask][place++] = static_cast<std::uint8_t>(4 * lane + byte);
      }
    }
    return orders;
  }();

  v128_t low_, high_;
  int low_count_, count_;
};

inline unsigned lanes_unlike(const std::uint32_t* numbers, std::uint32_t value) {
  const v128_t sought = wasm_i32x4_splat(static_cast<int>(value));
  const auto unlike = [&](const std::uint32_t* four) {
    return static_cast<unsigned>(wasm_i32x4_bitmask(wasm_i32x4_ne(wasm_v128_load(four), sought)));
  };
  return unlike(numbers) | unlike(numbers + 4) << 4;
}

#else

class Compaction {
 public:
  explicit Compaction(unsigned mask) : mask_(mask) {}

  int count() const { return std::popcount(mask_); }
  template <class Number>
  void operator()(const Number* from, Number* to) const {
    static_assert(sizeof(Number) == 4);
    each([&](unsigned place, unsigned lane) { to[place] = from[lane]; });
  }
  void operator()(const std::uint32_t* low, const std::uint32_t* high, std::uint64_t* to) const {
    each([&](unsigned place, unsigned lane) {
      to[place] = std::uint64_t{high[lane]} << 32 | low[lane];
    });
  }

 private:
  template <class Move>
  void each(const Move& move) const {
    unsigned place = 0;
    for (unsigned lane = 0; lane < 8; ++lane) {
      move(place, lane);
      place += mask_ >> lane & 1;
    }
  }

  unsigned mask_;
};

inline unsigned lanes_unlike(const std::uint32_t* numbers, std::uint32_t value) {
  unsigned unlike = 0;
  for (unsigned lane = 0; lane < 8; ++lane) unlike |= unsigned{numbers[lane] != value} << lane;
  return unlike;
}

#endif

// The bits of the first `count` of eight lanes, all of them for more.
inline unsigned first_lanes(int count) { return count < 8 ? (1u << count) - 1 : 255u; }

}  // namespace organbake
