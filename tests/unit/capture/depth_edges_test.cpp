// SPDX-License-Identifier: GPL-3.0-or-later
#include "depth_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace organbake {
namespace {

constexpr int kSize = 24;
constexpr double kFocal = 100, kReach = 4;
constexpr float kNothing = std::numeric_limits<float>::infinity();

std::vector<float> distances(const std::function<float(int, int)>& depth) {
  std::vector<float> map(kSize * kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) map[y * kSize + x] = depth(x, y);
  return depth_edge_distance(map, kSize, kSize, kFocal, kReach);
}

TEST(DepthEdges, APlaneHasOnlyTheImagesBorder) {
  // 1 mm a texel, then five: steep, but a plane.
  for (const float slope : {0.0f, 1.0f, 5.0f}) {
    const auto map = distances([&](int x, int) { return 100 + slope * static_cast<float>(x); });
    EXPECT_FLOAT_EQ(map[12 * kSize + 12], kReach);
    EXPECT_FLOAT_EQ(map[12 * kSize], 0.5f);
    EXPECT_FLOAT_EQ(map[12 * kSize + 2], 2.5f);
    EXPECT_FLOAT_EQ(map[kSize * kSize - 1], 0.5f);
  }
}

TEST(DepthEdges, AStepIsAnEdgeForBothSides) {
  const auto map = distances([](int x, int) { return x < 12 ? 100.0f : 120.0f; });
  EXPECT_FLOAT_EQ(map[12 * kSize + 11], 0.5f);
  EXPECT_FLOAT_EQ(map[12 * kSize + 12], 0.5f);
  EXPECT_FLOAT_EQ(map[12 * kSize + 9], 2.5f);
  EXPECT_FLOAT_EQ(map[12 * kSize + 18], kReach);
}

TEST(DepthEdges, OutlinesCountAndBackgroundIsZero) {
  const auto map = distances([](int x, int y) { return x + y < 24 ? 100.0f : kNothing; });
  EXPECT_EQ(map[20 * kSize + 20], 0);
  EXPECT_EQ(map[12 * kSize + 12], 0);
  EXPECT_FLOAT_EQ(map[11 * kSize + 12], 0.5f);
  EXPECT_NEAR(map[10 * kSize + 11], std::sqrt(3.25), 1e-6);
}

TEST(DepthEdges, AnEmptyMapIsAllZero) {
  for (const float value : distances([](int, int) { return kNothing; })) EXPECT_EQ(value, 0);
}

TEST(DepthEdges, OneTexelMaps) {
  EXPECT_EQ(depth_edge_distance(std::vector<float>{5.0f}, 1, 1, kFocal, kReach)[0], 0.5f);
  EXPECT_EQ(depth_edge_distance(std::vector<float>{kNothing}, 1, 1, kFocal, kReach)[0], 0);
}

}  // namespace
}  // namespace organbake
