// SPDX-License-Identifier: GPL-3.0-or-later
#include "spread_directions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace organbake {
namespace {

constexpr double kPi = std::numbers::pi;
// Where the search stops: forces vanish to rounding, angles are then good to its square root.
constexpr double kAtRest_rad = 1e-6;

std::vector<Eigen::Vector3d> all_round(int count) {
  return spread_directions(count, {0, -1, 0}, kPi);
}

double least_angle(const std::vector<Eigen::Vector3d>& directions) {
  double most_cosine = -1;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      most_cosine = std::max(most_cosine, directions[i].dot(directions[j]));
    }
  }
  return std::acos(most_cosine);
}

TEST(SpreadDirections, ReachTheKnownSolutions) {
  EXPECT_NEAR(least_angle(all_round(2)), kPi, kAtRest_rad);
  EXPECT_NEAR(least_angle(all_round(3)), 2 * kPi / 3, kAtRest_rad);
  EXPECT_NEAR(least_angle(all_round(4)), std::acos(-1.0 / 3), kAtRest_rad);  // tetrahedron
  EXPECT_NEAR(least_angle(all_round(6)), kPi / 2, kAtRest_rad);              // octahedron
  EXPECT_NEAR(least_angle(all_round(12)), std::atan(2.0), kAtRest_rad);      // icosahedron
}

// Two squares turned by 45°: every camera has four neighbours at most an edge away.
TEST(SpreadDirections, EightMakeASquareAntiprism) {
  const auto directions = all_round(8);
  // The best packing of eight is at 74.86°, a cube's at 70.53°.
  EXPECT_GT(least_angle(directions), 71.5 * kPi / 180);
  for (const auto& d : directions) {
    std::vector<double> angles;
    for (const auto& other : directions) angles.push_back(std::acos(std::min(1.0, d.dot(other))));
    std::sort(angles.begin(), angles.end());
    EXPECT_LT(angles[4], 80 * kPi / 180);
    EXPECT_GT(angles[5], 100 * kPi / 180);
  }
}

TEST(SpreadDirections, AreUnitAndStartOnTheAxis) {
  for (const int count : {1, 2, 3, 4, 7, 8, 20}) {
    const auto directions = spread_directions(count, {1, 2, 3}, kPi);
    ASSERT_EQ(std::ssize(directions), count);
    EXPECT_LT((directions[0] - Eigen::Vector3d(1, 2, 3).normalized()).norm(), 1e-7);
    for (const auto& d : directions) EXPECT_NEAR(d.norm(), 1, 1e-15);
  }
}

TEST(SpreadDirections, StayInTheConeAndReachItsRim) {
  for (const double half_angle : {0.05, 0.5, 1.5}) {
    for (const int count : {2, 3, 4, 8, 20}) {
      const Eigen::Vector3d axis(1, -1, 1);
      double largest = 0;
      for (const auto& d : spread_directions(count, axis, half_angle)) {
        largest = std::max(largest, std::acos(std::min(1.0, d.dot(axis.normalized()))));
      }
      EXPECT_NEAR(largest, half_angle, 1e-6);
    }
  }
}

TEST(SpreadDirections, AreEven) {
  for (const int count : {16, 32, 64}) {
    // Hexagonal packing is the bound; a random set would be near 0, a spiral at 0.85 of this.
    const double bound = std::sqrt(8 * kPi / (std::sqrt(3.0) * count));
    EXPECT_GT(least_angle(all_round(count)), 0.85 * bound) << count;
  }
}

TEST(SpreadDirections, AreAlwaysTheSame) { EXPECT_EQ(all_round(20), all_round(20)); }

}  // namespace
}  // namespace organbake
