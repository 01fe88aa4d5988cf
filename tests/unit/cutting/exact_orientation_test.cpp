// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "organbake/cutting/exact_orientation.h"

namespace organbake {
namespace {

using Random = std::mt19937_64;

GridPoint at(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t rank) {
  return {{x, y, z}, rank};
}

TEST(ExactOrientation, TellsTheSides) {
  const GridPoint o = at(0, 0, 0, 0), x = at(9, 0, 0, 1), y = at(0, 9, 0, 2);
  EXPECT_EQ(orientation(o, x, y, at(3, 3, 1, 3)), 1);
  EXPECT_EQ(orientation(o, x, y, at(3, 3, -1, 3)), -1);
}

// On a grid of few places nearly all are degenerate: on planes, on lines, one on the other.
TEST(ExactOrientation, NeverContradictsItself) {
  Random random(1);
  const auto some = [&](std::uint32_t rank) {
    const auto one = [&] {
      return std::int64_t(random() % 3) * (std::int64_t{1} << 30) - (1 << 30);
    };
    return at(one(), one(), one(), rank);
  };
  for (int i = 0; i < 20000; ++i) {
    GridPoint p[4] = {some(0), some(1), some(2), some(3)};
    std::swap(p[random() % 4].rank, p[random() % 4].rank);
    const int sign = orientation(p[0], p[1], p[2], p[3]);
    ASSERT_EQ(std::abs(sign), 1);
    ASSERT_EQ(orientation(p[1], p[0], p[2], p[3]), -sign);
    ASSERT_EQ(orientation(p[1], p[2], p[0], p[3]), sign);
    ASSERT_EQ(orientation(p[0], p[1], p[3], p[2]), -sign);
  }
}

// A way from the outside crosses a closed surface an odd number of times when it ends inside,
// however it runs along the surface's edges and through its corners.
TEST(ExactOrientation, CrossingsOfAClosedSurfaceAreOddInside) {
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  std::array<GridPoint, 8> c;
  for (std::uint32_t k = 0; k < 8; ++k) c[k] = at((k & 1) * 2, (k >> 1 & 1) * 2, (k >> 2) * 2, k);
  Random random(2);
  for (int i = 0; i < 5000; ++i) {
    const auto coordinate = [&] { return std::int64_t(random() % 5) - 1; };
    const GridPoint from = at(coordinate(), coordinate(), coordinate(), 20);
    const GridPoint to = at(-5 + coordinate(), -7 + coordinate(), coordinate(), 21);
    int crossed = 0;
    for (const auto& s : kSides)
      crossed += crosses(from, to, {c[s[0]], c[s[1]], c[s[2]]}) +
                 crosses(from, to, {c[s[0]], c[s[2]], c[s[3]]});
    bool within = true, outside = false;
    for (const std::int64_t v : from.at) {
      within = within && v > 0 && v < 2;
      outside = outside || v < 0 || v > 2;
    }
    if (within) {
      ASSERT_EQ(crossed % 2, 1);
    }
    if (outside) {
      ASSERT_EQ(crossed % 2, 0);
    }
  }
}

TEST(ExactOrientation, FarAndUndefinedPlacesStayOnTheGrid) {
  const MaterialGrid grid(Eigen::Vector3d(10, 20, 30));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(grid.snapped({10, 20, 30}, 7).at, (std::array<std::int64_t, 3>{0, 0, 0}));
  EXPECT_EQ(grid.snapped({1e300, -1e300, nan}, 0).at,
            (std::array<std::int64_t, 3>{1ll << 31, -(1ll << 31), 1ll << 31}));
}

}  // namespace
}  // namespace organbake
