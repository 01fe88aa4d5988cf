// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/contour_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

Polygon2 disc_of(double x, double radius, bool backward = false) {
  Polygon2 points;
  constexpr int kPoints = 720;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = (backward ? -2 : 2) * M_PI * i / kPoints;
    points.emplace_back(x + radius * std::cos(angle), radius * std::sin(angle));
  }
  return points;
}

double area(const ContourRegion& region) {
  constexpr double kStep = 0.05;
  double sum = 0;
  for (double y = -60 + kStep / 2; y < 60; y += kStep) {
    for (const auto& [from, to] : region.row(y)) sum += kStep * (to - from);
  }
  return sum;
}

double disc(double radius) { return M_PI * radius * radius; }

// Of 180 points and rows: 1e-3 of the area.
constexpr double kTolerance = 1e-3;

TEST(ContourRegion, OverlappingContoursAreUnited) {
  const ContourRegion region({{disc_of(0, 25)}, {disc_of(25, 15)}});
  // Two circles' union, by the formula of their lens.
  const double r = 25, s = 15, d = 25;
  const double lens = r * r * std::acos((d * d + r * r - s * s) / (2 * d * r)) +
                      s * s * std::acos((d * d + s * s - r * r) / (2 * d * s)) -
                      0.5 * std::sqrt((-d + r + s) * (d + r - s) * (d - r + s) * (d + r + s));
  const double right = disc(25) + disc(15) - lens;
  EXPECT_NEAR(area(region) / right, 1, kTolerance);
  EXPECT_EQ(region.holes(), 0u);
}

TEST(ContourRegion, OneInsideAnotherIsAHoleAndOneInsideThatAnIsland) {
  const ContourRegion region({{disc_of(0, 10)}, {disc_of(0, 25)}, {disc_of(2, 4)}});
  EXPECT_NEAR(area(region) / (disc(25) - disc(10) + disc(4)), 1, kTolerance);
  EXPECT_EQ(region.holes(), 1u);
}

TEST(ContourRegion, AHoleInTwoThatOverlapIsAHole) {
  const ContourRegion region({{disc_of(-5, 25)}, {disc_of(5, 25)}, {disc_of(0, 6)}});
  const ContourRegion filled({{disc_of(-5, 25)}, {disc_of(5, 25)}});
  EXPECT_NEAR((area(filled) - area(region)) / disc(6), 1, kTolerance);
}

TEST(ContourRegion, TheSameContourTwiceCountsOnce) {
  Polygon2 again = disc_of(0, 25, true);
  std::rotate(again.begin(), again.begin() + 100, again.end());
  const ContourRegion region({{disc_of(0, 25)}, {again}});
  EXPECT_NEAR(area(region) / disc(25), 1, kTolerance);
  EXPECT_EQ(region.repeated(), 1u);
  EXPECT_EQ(region.holes(), 0u);
}

TEST(ContourRegion, ContoursOfOneEvenOddSetCutEachOther) {
  const ContourRegion region({{disc_of(0, 25), disc_of(0, 10)}});
  EXPECT_NEAR(area(region) / (disc(25) - disc(10)), 1, kTolerance);
}

}  // namespace
}  // namespace organbake
