// SPDX-License-Identifier: GPL-3.0-or-later
// The evidence measures what it says on reliefs and hues made for it, and the share follows it.
// How good the share is, organbench's suite relief tells.
#include "organbake/shading/relief_share.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/image/srgb.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {
namespace {

constexpr int kWidth = 100, kHeight = 80;

struct Made {
  PreparedFrame frame;
  RangeEstimate estimate;
};

// ln z and ln of green by red as functions of normalised image coordinates.
template <class LogDepth, class Hue>
Made made(const LogDepth& log_z, const Hue& hue) {
  Made m;
  m.frame.camera = assumed_camera(kWidth, kHeight, 1.2);
  m.frame.color = Rgb8Image(kWidth, kHeight);
  m.frame.diffuse = m.frame.tissue = Mask(kWidth, kHeight, 1);
  m.estimate.usable = true;
  m.estimate.unexplained = 0.1;
  m.estimate.log_range = Plane(kWidth, kHeight);
  const RayGrid rays = ray_grid(m.frame.camera);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double u = rays.x(x), v = rays.y(y);
      m.estimate.log_range.at(x, y) =
          static_cast<float>(log_z(u, v) + 0.5 * std::log1p(u * u + v * v));
      const auto red = static_cast<float>(0.4);
      m.frame.color.at(x, y)[0] = srgb8_from_linear(red);
      m.frame.color.at(x, y)[1] = srgb8_from_linear(red * static_cast<float>(std::exp(hue(u, v))));
    }
  return m;
}

constexpr auto kOneHue = [](double, double) { return -0.7; };
constexpr double kClose = 0.02;  // 8-bit hues, and cells that cut the view unevenly

TEST(ReliefShare, ATiltIsToldFromABowl) {
  const Made tilted = made([](double u, double v) { return 0.3 * u - 0.2 * v; }, kOneHue);
  const Made bowl = made([](double u, double v) { return u * u + v * v; }, kOneHue);
  EXPECT_NEAR(relief_evidence(tilted.frame, tilted.estimate).tilt_share, 1, kClose);
  EXPECT_NEAR(relief_evidence(bowl.frame, bowl.estimate).tilt_share, 0, kClose);
}

TEST(ReliefShare, ReliefThatFollowsTheHueIsNoticed) {
  const auto waves = [](double u, double v) { return 0.2 * std::sin(9 * u) * std::cos(7 * v); };
  const auto pale_is_near = [&](double u, double v) { return -0.7 - 2 * waves(u, v); };
  const auto of_its_own = [](double u, double v) { return -0.7 + 0.4 * std::cos(9 * u + 7 * v); };
  const Made albedo = made(waves, pale_is_near), shape = made(waves, of_its_own);
  EXPECT_NEAR(relief_evidence(albedo.frame, albedo.estimate).hue_correlation, -1, kClose);
  EXPECT_NEAR(relief_evidence(shape.frame, shape.estimate).hue_correlation, 0, 0.1);
}

TEST(ReliefShare, WhatIsMaskedDoesNotCount) {
  Made m = made([](double u, double) { return 0.3 * u; }, kOneHue);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth / 2; ++x) {
      m.frame.diffuse.at(x, y) = 0;
      m.estimate.log_range.at(x, y) = 5;
    }
  EXPECT_NEAR(relief_evidence(m.frame, m.estimate).tilt_share, 1, kClose);
  m.frame.diffuse = Mask(kWidth, kHeight);
  EXPECT_EQ(relief_evidence(m.frame, m.estimate).tilt_share, 0);
}

TEST(ReliefShare, IsAllOfAnExplainedPictureAndFallsWithoutSteps) {
  for (const auto part : {&ReliefShare::tilt, &ReliefShare::rest}) {
    const auto share = [&](double unexplained, double tilt, double hue) {
      return relief_share({unexplained, tilt, hue}).*part;
    };
    EXPECT_EQ(share(0.02, 0, -1), 1);
    constexpr double kStep = 0.0005, kMostChange = 0.035;
    for (const double tilt : {0.0, 0.9}) {
      double before = 1;
      for (double unexplained = 0; unexplained < 0.4; unexplained += kStep) {
        EXPECT_GT(share(unexplained, tilt, 0), before - kMostChange);
        before = share(unexplained, tilt, 0);
      }
      EXPECT_LT(before, 0.8) << "hardly anything is explained";
    }
    EXPECT_GT(share(0.1, 0.4, 0.5), share(0.1, 0.4, -0.5));
  }
  EXPECT_GT(relief_share({0.1, 0.8, 0}).tilt, relief_share({0.1, 0.1, 0}).tilt);
}

// A tilt with waves on it that have none.
TEST(ReliefShare, TheTiltIsKeptWithoutTheRest) {
  const auto tilt = [](double u, double v) { return 0.3 * u - 0.2 * v; };
  Made m = made([&](double u, double v) { return tilt(u, v) + 0.1 * std::cos(20 * u); }, kOneHue);
  const RayGrid rays = ray_grid(m.frame.camera);
  Plane kept = m.estimate.log_range;
  keep_relief(rays, m.frame.tissue, {.tilt = 1, .rest = 0}, kept);
  const auto log_z = [&](int x, int y) {
    const double u = rays.x(x), v = rays.y(y);
    return kept.at(x, y) - 0.5 * std::log1p(u * u + v * v);
  };
  const double middle =
      log_z(kWidth / 2, kHeight / 2) - tilt(rays.x(kWidth / 2), rays.y(kHeight / 2));
  for (const int x : {0, 20, kWidth - 1})
    EXPECT_NEAR(log_z(x, 10) - middle, tilt(rays.x(x), rays.y(10)), 0.01);
  keep_relief(rays, m.frame.tissue, {}, kept);
  EXPECT_NEAR(log_z(0, 0), log_z(kWidth - 1, kHeight - 1), 1e-6) << "a plane across the axis";
}

// Frame by frame the share goes half the way to what a frame tells by itself.
TEST(ReliefShare, AlikeFramesEvenItOut) {
  const Made m = made([](double u, double v) { return 0.3 * u - 0.2 * v; }, kOneHue);
  const double own = judge_depth(m.frame, m.estimate).support;
  DepthQuality before;
  before.support = 0;
  EXPECT_DOUBLE_EQ(judge_depth(m.frame, m.estimate, &before).support, 0.5 * own);
  RangeEstimate taken_over = m.estimate;
  taken_over.warm = true;
  EXPECT_EQ(judge_depth(m.frame, taken_over, &before).support, 0) << "with the depth";
}

}  // namespace
}  // namespace organbake
