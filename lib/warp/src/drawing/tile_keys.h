// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/warp/pixel_box.h"
#include "placing/chunk_frame.h"

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

  void clear(const PixelBox& tile, const PixelBox& part) {
    box = part;
    origin_x = tile.x0, origin_y = tile.y0;
    stride = part.width() + 2 * kGuard;
    keys.assign(std::size_t(stride) * (part.height() + 2 * kGuard), kEmptyKey);
  }
  const std::uint64_t* row(int y) const {  // y of the picture
    return keys.data() + std::size_t(y - box.y0 + kGuard) * stride + kGuard;
  }
};

}  // namespace organbake
