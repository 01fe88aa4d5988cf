// SPDX-License-Identifier: GPL-3.0-or-later
#include "tissue_skin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tissue_of_tests.h"
#include "vessel_tree.h"

namespace organbake {
namespace {

const TissueSkin& mottled() {
  static const TissueSkin skin(relief(), 1, 0.1);
  return skin;
}

// Standard deviation of the logarithm of red along rows of liver, of differences so far apart.
double contrast(const TissueSkin& skin, double apart_mm) {
  double squares = 0, count = 0;
  for (double y = -30; y < -18; y += 0.31)
    for (double x = -45; x < -10; x += 0.17, ++count)
      squares +=
          std::pow(std::log(skin.at(x + apart_mm, y).albedo.x() / skin.at(x, y).albedo.x()), 2);
  return std::sqrt(squares / count / 2);
}

TEST(TissueSkin, IsMottledAtAllSizes) {
  const TissueSkin& skin = mottled();
  EXPECT_GT(contrast(skin, 0.3), 0.03);
  EXPECT_GT(contrast(skin, 1), 1.2 * contrast(skin, 0.3));
  EXPECT_GT(contrast(skin, 5), 1.1 * contrast(skin, 1));
  EXPECT_LT(contrast(skin, 5), 0.3);
}

TEST(TissueSkin, WithoutMottlingATissueIsOfOneColour) {
  const TissueSkin skin(relief(), 1, 0);
  EXPECT_LT(contrast(skin, 5), 1e-3);
}

TEST(TissueSkin, TissuesDifferInColour) {
  const TissueSkin& skin = mottled();
  const Eigen::Vector3d liver = skin.at(-27, -24).albedo, fat = skin.at(-20, 35).albedo;
  EXPECT_GT(liver.x() / liver.y(), 4);
  EXPECT_LT(fat.x() / fat.y(), 3);
}

TEST(TissueSkin, TheFilmsTiltIsSmallAndBalanced) {
  const TissueSkin& skin = mottled();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), squares = Eigen::Vector2d::Zero();
  double count = 0;
  for (double x = -40; x < 40; x += 0.37)
    for (double y = -40; y < 40; y += 0.37, ++count) {
      const Eigen::Vector2d tilt = skin.at(x, y).film_tilt;
      sum += tilt;
      squares += tilt.cwiseAbs2();
    }
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(sum[axis] / count, 0, 0.01);
    EXPECT_GT(std::sqrt(squares[axis] / count), 0.02);
    EXPECT_LT(std::sqrt(squares[axis] / count), 0.2);
  }
}

TEST(VesselTree, VesselsTaperAndLeaveNoGaps) {
  const std::vector<VesselSpot> spots = grow_vessels(3, 40, {50, 40});
  ASSERT_GT(spots.size(), 2000u);
  int joined = 0;
  double thickest = 0, thinnest = 1;
  for (std::size_t i = 1; i < spots.size(); ++i) {
    const double apart = (spots[i].center_mm - spots[i - 1].center_mm).norm();
    joined += apart <= spots[i - 1].radius_mm + spots[i].radius_mm;
    thickest = std::max(thickest, spots[i].radius_mm);
    thinnest = std::min(thinnest, spots[i].radius_mm);
    EXPECT_LT((spots[i].center_mm.cwiseAbs() - Eigen::Vector2d(50, 40)).maxCoeff(), 0);
  }
  EXPECT_GT(joined, 0.9 * double(spots.size()));  // but where another branch begins
  EXPECT_LT(thickest, 1);
  EXPECT_LT(thinnest, 0.1);
}

}  // namespace
}  // namespace organbake
