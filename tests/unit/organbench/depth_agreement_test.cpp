// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/depth_agreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "organbake/core/random.h"

namespace organbake {
namespace {

TEST(DepthAgreement, OneScaleIsTakenOutAndNoMore) {
  DepthPairs pairs;
  RandomStream random(1);
  for (int i = 0; i < 4000; ++i) {
    const double truth = random.uniform(30, 90), off = i % 2 ? 1.02 : 0.98;
    pairs.add(static_cast<float>(0.1 * truth * off), static_cast<float>(truth));
  }
  const DepthAgreement found = agreement_of(pairs);
  EXPECT_NEAR(found.scale, 10, 0.25);
  EXPECT_NEAR(found.mean_percent, 2, 0.15);
  EXPECT_GT(found.spearman, 0.99);
  EXPECT_EQ(found.covered_percent, 100);
}

TEST(DepthAgreement, WhatIsMissingLowersTheCoverageAlone) {
  DepthPairs pairs;
  for (int i = 1; i <= 100; ++i)
    pairs.add(i <= 80 ? static_cast<float>(i) : INFINITY, static_cast<float>(i));
  pairs.add(5, INFINITY);  // without a truth it is not asked for
  const DepthAgreement found = agreement_of(pairs);
  EXPECT_EQ(found.covered_percent, 80);
  EXPECT_EQ(found.mean_percent, 0);
  EXPECT_THROW(agreement_of(DepthPairs{}), std::invalid_argument);
}

TEST(DepthAgreement, RanksAreCompared) {
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {1, 4, 9, 16}), 1);
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {4, 3, 2, 1}), -1);
  // By hand: ranks 0.5 0.5 2 3 and 0 1 2 3 give 4.5 / √(4.5 · 5).
  EXPECT_NEAR(spearman({1, 1, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(22.5), 1e-12);
  EXPECT_EQ(spearman({1, 1}, {1, 2}), 0);
}

// A plane's map at half the size agrees with the whole one to the last digit.
TEST(DepthAgreement, MapsOfOtherSizesMeetAtPixelCentres) {
  Plane whole(40, 20), half(20, 10);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 40; ++x) whole.at(x, y) = 50 + 0.5f * (x + 0.5f) + 0.25f * (y + 0.5f);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) half.at(x, y) = 50 + 1.0f * (x + 0.5f) + 0.5f * (y + 0.5f);
  whole.at(0, 0) = INFINITY;
  DepthPairs pairs;
  pairs.add_maps(half, whole);
  EXPECT_EQ(pairs.asked, 199u);
  EXPECT_LT(agreement_of(pairs).mean_percent, 1e-4);
}

TEST(DepthAgreement, PointsBehindNearerOnesAreHidden) {
  PosedCamera camera;
  camera.intrinsics = {100, 80, 50, 50, 50, 40};
  const std::vector<Eigen::Vector3d> cloud = {
      {0, 0, 10}, {0.1, 0.1, 12}, {0, 0, -5}, {5, 0, 10}, {50, 0, 10}};
  const auto seen = nearest_points(camera, cloud, 8);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].depth, 10);
  EXPECT_EQ(seen[0].pixel, Eigen::Vector2d(50, 40));
  EXPECT_EQ(seen[1].pixel, Eigen::Vector2d(75, 40));
}

}  // namespace
}  // namespace organbake
