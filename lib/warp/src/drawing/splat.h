// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "picture/spans.h"
#include "placing/placing.h"
#include "samples/samples.h"

namespace organbake {

// What a pixel remembers of the sample that won it, in one 64-bit number whose smallest value wins:
//   28 bits depth (float without sign and last 3 bits; mm + the tie-break below),
//    6 + 6 bits offset (v, u) from the sample to the pixel's centre, in 1/31 of kReach texels,
//   24 bits sample slot.
// Depth is that of the sample's patch at the pixel's centre plus tie·(u² + v²), so that on one
// surface the nearest sample wins, and of two surfaces the nearer one.
inline constexpr std::uint64_t kEmptyKey = 0xFF00000000000000u;  // depth +inf, slot 0
inline constexpr std::uint32_t kEmptyHigh = 0xFF000000u;

// Tie-break at full reach: texel sizes of depth. More would mix surfaces, less lets the slope
// inside a patch decide between neighbours.
inline constexpr float kTieTexels = 1.1f;

// A patch's plane may run behind the eye between its sample and a pixel; what is seen does not.
inline constexpr float kLeastDepth_mm = 1e-6f;

// share of the reach, −1…1
inline std::uint32_t offset_bits(float share) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(share * 31.0f + 32.5f));
}
inline float offset_share(std::uint32_t bits) {
  return (static_cast<float>(static_cast<std::int32_t>(bits)) - 32.0f) * (1 / 31.0f);
}

inline std::uint32_t key_high(float depth, std::uint32_t v_bits) {
  return ((__builtin_bit_cast(std::uint32_t, depth) << 1) & ~15u) | (v_bits >> 2);
}
inline std::uint32_t key_low(std::uint32_t u_bits, std::uint32_t v_bits, std::uint32_t slot) {
  return (v_bits << 30) | (u_bits << 24) | slot;
}
inline float depth_of(std::uint32_t high) { return __builtin_bit_cast(float, (high >> 1) & ~7u); }
inline std::uint32_t v_bits_of(std::uint32_t high, std::uint32_t low) {
  return (high & 15u) << 2 | low >> 30;
}
inline std::uint32_t u_bits_of(std::uint32_t low) { return (low >> 24) & 63u; }
inline std::uint32_t slot_of(std::uint32_t low) { return low & 0xFFFFFFu; }

// Keys of one camera over one tile of the picture, or a part of it, with a guard band all round so
// that a splat over the border needs no test per pixel.
struct TileKeys {
  static constexpr int kGuard = 8;

  PixelBox box;
  // The tile's corner. Samples are placed from there, whatever part is drawn: rounding differs from
  // corner to corner, a part must not.
  int origin_x = 0, origin_y = 0;
  int stride = 0;
  std::vector<std::uint64_t> keys;
  RowSpans spans;  // where samples may have placed

  void clear(const PixelBox& tile, const PixelBox& part) {
    box = part;
    origin_x = tile.x0, origin_y = tile.y0;
    stride = part.width() + 2 * kGuard;
    spans.clear(part);
    keys.assign(std::size_t(stride) * (part.height() + 2 * kGuard), kEmptyKey);
  }
  const std::uint64_t* row(int y) const {  // y of the picture
    return keys.data() + std::size_t(y - box.y0 + kGuard) * stride + kGuard;
  }
};

// How a pixel of a tile becomes the number of its cell.
struct CellGrid {
  int stride, guard;  // cells of a row; beyond each of the tile's borders

  int column(std::int32_t cell) const { return cell % stride - guard; }
  int row(std::int32_t cell) const { return cell / stride - guard; }
};
// For splats that may begin farther outside than a tile's own guard band.
inline constexpr CellGrid kAnySplat{1024, kMostSplat + 1};
static_assert(TileGrid::kWidth + 2 * kAnySplat.guard <= kAnySplat.stride);
static_assert((TileGrid::kHeight + 2 * kAnySplat.guard) * kAnySplat.stride <= 1 << 24);  // a float

// Where those of a chunk's samples land that touch a tile: offset from each to its first pixel's
// centre, depth, and that pixel's cell.
struct PlacedSamples {
  using Numbers = std::array<std::uint32_t, kChunk>;
  static_assert(kChunk % kLanes == 0);

  int count;
  alignas(64) std::array<float, kChunk> u, v, z;
  alignas(64) std::array<std::int32_t, kChunk> cell;
  alignas(64) Numbers sample, inside;  // which of the chunk's each is
};

void place_samples(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                   const FaceFrame& face, float near_mm, const TileKeys& tile,
                   const CellGrid& cells, PlacedSamples& placed);

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
    for (unsigned lane = 0; lane < 8; to += mask_ >> lane++ & 1) *to = from[lane];
  }
  void operator()(const std::uint32_t* low, const std::uint32_t* high, std::uint64_t* to) const {
    for (unsigned lane = 0; lane < 8; to += mask_ >> lane++ & 1)
      *to = std::uint64_t{high[lane]} << 32 | low[lane];
  }

 private:
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

// Sends for what splat_chunk() will read of a chunk, and for the colours that the tile's pixels
// will ask for in another order, row by row once more (resolve_tile()): they come while chunks
// before it are drawn. A frame in a twentieth less time.
void prefetch_chunk(const SampleSet& set, std::uint32_t chunk);

// Draws a chunk's samples into the tile. tie_mm = kTieTexels × texel size. What does not fall
// into the tile, lies before the near plane or loses its pixel leaves no trace.
void splat_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                 const FaceFrame& face, float near_mm, float tie_mm, TileKeys& tile);

}  // namespace organbake
