// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

namespace organbake {

// A place among the cells round points strewn in space, one in each cube of a lattice (Worley
// 1996).
struct Cell {
  float x, y, z;    // from its point
  float distance2;  // to it
  float border;     // how much farther the next point is, distances squared
  std::uint32_t hash;

  // One of four numbers of −1…1 that belong to the cell.
  float chance(int which) const {
    const std::uint32_t bits = (hash * 0x9e3779b1u) >> (8 * which) & 255u;
    return static_cast<float>(static_cast<std::int32_t>(bits)) * (1 / 127.5f) - 1;
  }
};

// x, y, z in cubes. Only the eight cubes about the place are asked, and points keep from their
// cubes' walls for that: now and then one farther off would be nearer, which shows as a cell that
// ends early. Hashes of whole numbers, the same everywhere; written out so that loops over pixels
// vectorise.
inline __attribute__((always_inline)) Cell nearest_cell(float x, float y, float z) {
  constexpr float kJitter = 0.8f, kStep = kJitter / 1023, kFirst = 0.5f - 0.5f * kJitter;
  constexpr std::uint32_t kX = 0x8da6b343u, kY = 0xd8163841u, kZ = 0xcb1ab31fu;
  const float x0 = std::floor(x - 0.5f), y0 = std::floor(y - 0.5f), z0 = std::floor(z - 0.5f);
  const std::uint32_t at = static_cast<std::uint32_t>(static_cast<std::int32_t>(x0)) * kX +
                           static_cast<std::uint32_t>(static_cast<std::int32_t>(y0)) * kY +
                           static_cast<std::uint32_t>(static_cast<std::int32_t>(z0)) * kZ;
  const float in_x = x - x0 - kFirst, in_y = y - y0 - kFirst, in_z = z - z0 - kFirst;
  Cell cell{0, 0, 0, 99, 99, 0};
  float second = 99;
  const auto ask = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k)
      __attribute__((always_inline)) {
    std::uint32_t h = at + i * kX + j * kY + k * kZ;
    h = (h ^ (h >> 15)) * 0x85ebca6bu;
    h ^= h >> 13;
    const auto part = [&](int shift) {
      return kStep * static_cast<float>(static_cast<std::int32_t>((h >> shift) & 1023u));
    };
    const float dx = in_x - static_cast<float>(i) - part(0);
    const float dy = in_y - static_cast<float>(j) - part(10);
    const float dz = in_z - static_cast<float>(k) - part(20);
    const float d2 = dx * dx + dy * dy + dz * dz;
    const bool nearer = d2 < cell.distance2;
    const float other = nearer ? cell.distance2 : d2;
    second = other < second ? other : second;
    cell.x = nearer ? dx : cell.x;
    cell.y = nearer ? dy : cell.y;
    cell.z = nearer ? dz : cell.z;
    cell.hash = nearer ? h : cell.hash;
    cell.distance2 = nearer ? d2 : cell.distance2;
  };
  ask(0, 0, 0), ask(1, 0, 0), ask(0, 1, 0), ask(1, 1, 0);
  ask(0, 0, 1), ask(1, 0, 1), ask(0, 1, 1), ask(1, 1, 1);
  cell.border = second - cell.distance2;
  return cell;
}

}  // namespace organbake
