// SPDX-License-Identifier: GPL-3.0-or-later
#include "scope_exposure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kWidth = 101, kHeight = 61;

SensorLight spot_of_light() {
  SensorLight light(kWidth, kHeight);
  light.radiance[30 * kWidth + 50].setConstant(1);
  return light;
}

Intrinsics lens() { return {kWidth, kHeight, 80, 80, kWidth / 2.0, kHeight / 2.0}; }

// A turn about y moves what is seen along x.
TEST(ScopeExposure, ATurnLeavesATrailOfItsLength) {
  constexpr double kTrail_px = 10;
  const SensorLight blurred = blurred_by_turn(spot_of_light(), lens(), {0, kTrail_px / 80});
  double sum = 0, mean = 0, spread = 0;
  for (int x = 0; x < kWidth; ++x) {
    const double value = blurred.radiance[30 * kWidth + x][0];
    sum += value;
    mean += value * x;
    spread += value * (x - 50.0) * (x - 50.0);
  }
  EXPECT_NEAR(sum, 1, 0.02);  // no light is lost; the trail bends by next to nothing
  EXPECT_NEAR(mean / sum, 50, 0.05);
  EXPECT_NEAR(std::sqrt(12 * spread / sum), kTrail_px, 0.5);  // an even trail's length
  EXPECT_LT(blurred.radiance[34 * kWidth + 50][0], 1e-6);
}

TEST(ScopeExposure, EncodesAsSrgbWithNoiseOfItsDeviation) {
  SensorLight light(400, 300);
  for (auto& value : light.radiance) value = {0.5f, 0.2f, 0.02f};
  const Rgb8Image image = exposed(light, {.noise = 0.02});
  for (int c = 0; c < 3; ++c) {
    double sum = 0, squares = 0, count = 0;
    for (int y = 140; y < 160; ++y)
      for (int x = 190; x < 210; ++x, ++count) {
        sum += image.at(x, y)[c];
        squares += image.at(x, y)[c] * image.at(x, y)[c];
      }
    const double mean = sum / count;
    const double wanted = 255 * srgb_from_linear(light.radiance[0][c]);
    EXPECT_NEAR(mean, wanted, 1);  // 400 pixels of 5.1 grey levels of noise
    EXPECT_NEAR(std::sqrt(squares / count - mean * mean), 5.1, 0.8);
  }
}

TEST(ScopeExposure, TheStopIsBlack) {
  SensorLight light(kWidth, kHeight);
  for (auto& value : light.radiance) value.setConstant(0.5f);
  const ScopeSensor sensor{.noise = 0, .stop_radius_px = 20};
  const Rgb8Image image = exposed(light, sensor);
  EXPECT_EQ(image.at(50 + 21, 30)[0], 0);
  EXPECT_GT(image.at(50 + 19, 30)[0], 100);
}

TEST(ScopeExposure, TheColumnsWithinTheStopAreThoseNotBehindIt) {
  const ScopeSensor sensor{.stop_radius_px = 35};
  for (int y = 0; y < kHeight; ++y) {
    const auto [first, last] = columns_in_stop(sensor, 0, kWidth, kHeight, y);
    for (int x = 0; x < kWidth; ++x) {
      const bool inside = x >= first && x < last;
      // The column at either end may be cut by the stop.
      EXPECT_TRUE(inside || behind_stop(sensor, kWidth, kHeight, x, y));
      EXPECT_TRUE(!inside || x == first || x == last - 1 ||
                  !behind_stop(sensor, kWidth, kHeight, x, y));
    }
  }
  EXPECT_EQ(columns_in_stop({}, 0, kWidth, kHeight, 3), std::pair(0, kWidth));
  EXPECT_EQ(columns_in_stop({.stop_radius_px = 10}, 0, kWidth, kHeight, 3), std::pair(0, 0));
}

}  // namespace
}  // namespace organbake
