// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

namespace organbake {

// One of the points strewn in space, one in each cube of a lattice (Worley 1996), near a place.
struct StrewnCell {
  float x, y, z;  // of the place, from the point
  std::uint32_t hash;

  float distance2() const { return x * x + y * y + z * z; }
  // One of four numbers of −1…1 that belong to the point.
  float chance(int which) const {
    const std::uint32_t bits = (hash * 0x9e3779b1u) >> (8 * which) & 255u;
    return static_cast<float>(static_cast<std::int32_t>(bits)) * (1 / 127.5f) - 1;
  }
};

// visit(StrewnCell) for the points of the eight cubes about a place, x, y, z in cubes. Points keep
// from their cubes' walls: of the others none is nearer than kStrewnReach. Hashes of whole numbers,
// the same everywhere; written out so that loops over pixels vectorise.
inline constexpr float kJitter = 0.7f, kStrewnReach = 1 - 0.5f * kJitter;
template <class Visit>
inline __attribute__((always_inline)) void visit_cells(float x, float y, float z,
                                                       const Visit& visit) {
  constexpr float kStep = kJitter / 1023, kFirst = 0.5f - 0.5f * kJitter;
  constexpr std::uint32_t kX = 0x8da6b343u, kY = 0xd8163841u, kZ = 0xcb1ab31fu;
  const float x0 = std::floor(x - 0.5f), y0 = std::floor(y - 0.5f), z0 = std::floor(z - 0.5f);
  const std::uint32_t at = static_cast<std::uint32_t>(static_cast<std::int32_t>(x0)) * kX +
                           static_cast<std::uint32_t>(static_cast<std::int32_t>(y0)) * kY +
                           static_cast<std::uint32_t>(static_cast<std::int32_t>(z0)) * kZ;
  const float in_x = x - x0 - kFirst, in_y = y - y0 - kFirst, in_z = z - z0 - kFirst;
  const auto ask = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k)
      __attribute__((always_inline)) {
    std::uint32_t h = at + i * kX + j * kY + k * kZ;
    h = (h ^ (h >> 15)) * 0x85ebca6bu;
    h ^= h >> 13;
    const auto part = [&](int shift) {
      return kStep * static_cast<float>(static_cast<std::int32_t>((h >> shift) & 1023u));
    };
    visit(StrewnCell{in_x - static_cast<float>(i) - part(0),
                     in_y - static_cast<float>(j) - part(10),
                     in_z - static_cast<float>(k) - part(20), h});
  };
  ask(0, 0, 0), ask(1, 0, 0), ask(0, 1, 0), ask(1, 1, 0);
  ask(0, 0, 1), ask(1, 0, 1), ask(0, 1, 1), ask(1, 1, 1);
}

}  // namespace organbake
