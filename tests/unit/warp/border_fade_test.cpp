// SPDX-License-Identifier: Apache-2.0
#include "finishing/border_fade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "organbake/bundle/lighting.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kFadeSide = 96, kFade_px = 12;
constexpr std::array<std::uint8_t, 3> kNight = {0, 0, 0};
constexpr PixelBox kWholePicture = {0, 0, kFadeSide, kFadeSide};

// White skin on black.
Frame skin_where(const std::function<bool(double x, double y)>& inside) {
  Frame frame;
  frame.color = Rgb8Image(kFadeSide, kFadeSide);
  frame.cover.assign(std::size_t(kFadeSide) * kFadeSide, Cover::background);
  for (int y = 0; y < kFadeSide; ++y) {
    for (int x = 0; x < kFadeSide; ++x) {
      if (!inside(x + 0.5, y + 0.5)) continue;
      frame.cover[std::size_t(y) * kFadeSide + x] = Cover::samples;
      std::fill_n(frame.color.at(x, y), 3, std::uint8_t{255});
    }
  }
  return frame;
}

float white_share(const Frame& frame, int x, int y) {
  return linear_from_srgb8()[frame.color.at(x, y)[0]];
}

TEST(BorderFade, ObliqueBordersFadeByTheDistanceAloneOverTheWidth) {
  const double angle = 0.4, c = std::cos(angle), s = std::sin(angle);
  const auto depth = [&](double x, double y) { return c * (x - 48) + s * (y - 48); };
  Frame frame = skin_where([&](double x, double y) { return depth(x, y) > 0; });
  BorderFade().apply(kWholePicture, kFade_px, kNight, frame);
  std::vector<double> least(kFadeSide, 1), most(kFadeSide, 0);  // by whole pixels of distance
  // Beyond the picture's edge borders go straight on, away from it.
  for (int y = kFade_px; y < kFadeSide - kFade_px; ++y) {
    for (int x = kFade_px; x < kFadeSide - kFade_px; ++x) {
      const double d = depth(x + 0.5, y + 0.5), light = white_share(frame, x, y);
      if (d <= 0) continue;
      least[int(d)] = std::min(least[int(d)], light), most[int(d)] = std::max(most[int(d)], light);
      if (d > 1.2 * kFade_px) {
        EXPECT_EQ(light, 1) << x << ", " << y;
      }
    }
  }
  EXPECT_LT(most[0], 0.1);
  EXPECT_GT(least[kFade_px - 1], 0.97);
  for (int d = 1; d < kFade_px; ++d) {
    EXPECT_GE(least[d], most[d - 1] - 0.02) << d;  // no staircase: pixels as far in are as bright
    EXPECT_GE(most[d], most[d - 1]);
  }
  EXPECT_NEAR(0.5 * (least[4] + most[4]), 0.6, 0.15);
}

TEST(BorderFade, TeethAreCutAlongALine) {
  constexpr double kTooth = 3;
  Frame frame = skin_where([](double x, double y) {
    return y > 40 + kTooth * (std::fmod(x, 2 * kTooth) < kTooth ? 1 : 0);
  });
  BorderFade().apply(kWholePicture, kFade_px, kNight, frame);
  int first = kFadeSide, last = 0;  // rows in which columns are half lit first
  for (int x = kFade_px; x < kFadeSide - kFade_px; ++x) {
    int y = 0;
    while (white_share(frame, x, y) < 0.5f) ++y;
    first = std::min(first, y), last = std::max(last, y);
  }
  EXPECT_LE(last - first, 1);
}

TEST(BorderFade, SkinThatLeavesThePictureStays) {
  Frame frame = skin_where([](double, double) { return true; });
  const Frame before = frame;
  BorderFade().apply(kWholePicture, kFade_px, kNight, frame);
  EXPECT_EQ(frame.color.pixels, before.color.pixels);
}

TEST(BorderFade, EndsInTheBackgroundAndIsTakenBack) {
  const auto disc = [](double x, double y) { return std::hypot(x - 40, y - 50) < 30; };
  Frame frame = skin_where(disc);
  const Frame before = frame;
  BorderFade fade;
  const std::array<std::uint8_t, 3> background = {30, 11, 9};
  fade.apply({10, 20, 70, 80}, SkinFinish::kWidestFade_px, background, frame);
  EXPECT_EQ(frame.cover, before.cover);
  const std::uint8_t* const rim = frame.color.at(10, 50);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(rim[k], background[k]);
  EXPECT_EQ(frame.color.at(40, 50)[0], 255);
  EXPECT_EQ(frame.color.at(5, 50)[0], 0);  // the background is left alone
  fade.undo(frame);
  EXPECT_EQ(frame.color.pixels, before.color.pixels);
  fade.apply(kWholePicture, 1, background, frame);
  EXPECT_EQ(frame.color.pixels, before.color.pixels);
}

TEST(BorderFade, IsAnAngleOfTheViewUpToItsMost) {
  SkinFinish finish;
  EXPECT_EQ(finish.border_fade_px(1000), 0);
  finish.border_fade_rad = 0.01;
  EXPECT_EQ(finish.border_fade_px(1000), 10);
  EXPECT_EQ(finish.border_fade_px(260), 3);
  EXPECT_EQ(finish.border_fade_px(1e9), SkinFinish::kWidestFade_px);
}

}  // namespace
}  // namespace organbake
