// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/distant.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/phantom/known_answers.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/laparoscope.h"

namespace organbake {
namespace {

// The paper's formulae in p_s, q_s as printed, with the stable gain; written from the page alone.
std::vector<double> transcription(const Plane& image, double tilt, double slant, int iterations) {
  const int w = image.width, h = image.height;
  const double ps = std::cos(tilt) * std::sin(slant) / std::cos(slant);
  const double qs = std::sin(tilt) * std::sin(slant) / std::cos(slant);
  std::vector<double> z(image.size(), 0.0), s(image.size(), 0.0);
  for (int n = 0; n < iterations; ++n) {
    std::vector<double> next(image.size());
    for (int i = 0; i < h * w; ++i) {
      double p = 0, q = 0;
      if (i % w > 0 && i / w > 0) {
        p = z[i] - z[i - 1];
        q = z[i] - z[i - w];
      }
      const double pq = 1 + p * p + q * q, light = 1 + ps * ps + qs * qs;
      const double r = (p * ps + q * qs + 1) / (std::sqrt(pq) * std::sqrt(light));
      const double f = image.values[i] - std::max(0.0, r);
      const double df =
          (p + q) * (p * ps + q * qs + 1) / (std::sqrt(pq * pq * pq) * std::sqrt(light)) -
          (ps + qs) / (std::sqrt(pq) * std::sqrt(light));
      s[i] += df * df;
      next[i] = z[i] - df / (1e-8 + s[i]) * f;
    }
    z = next;
  }
  return z;
}

TEST(TsaiShah, EqualsAnIndependentTranscription) {
  for (double tilt : {0.3, 2.0, -1.2})
    for (double slant : {0.2, 0.7, 1.2}) {
      const DistantScene scene = distant_scene("peaks", 48, {tilt, slant});
      const TsaiShahEstimate estimate =
          shade_tsai_shah(scene.intensity, {.light = {tilt, slant}, .iterations = 12});
      const std::vector<double> expected = transcription(scene.intensity, tilt, slant, 12);
      for (std::size_t k = 0; k < expected.size(); ++k)
        ASSERT_NEAR(estimate.depth.values[k], expected[k],
                    1e-9 * std::max(1.0, std::abs(expected[k])))
            << tilt << " " << slant << " pixel " << k;
    }
}

TEST(TsaiShah, StartsFromThePreviousFrame) {
  const DistantScene scene = distant_scene("gauss", 32, {0.5, 0.6});
  const TsaiShahEstimate once =
      shade_tsai_shah(scene.intensity, {.light = {0.5, 0.6}, .iterations = 4});
  const TsaiShahEstimate again =
      shade_tsai_shah(scene.intensity, {.light = {0.5, 0.6}, .iterations = 1}, &once.depth);
  EXPECT_LT(again.residual, once.residual * 1.5);
  EXPECT_NE(again.depth, once.depth);
  const Grid<double> other(5, 5);
  EXPECT_THROW(shade_tsai_shah(scene.intensity, {}, &other), BadDataError);
}

TEST(TsaiShah, SingularLightsLeaveTheDepthFinite) {
  constexpr double kPi = std::numbers::pi;
  for (double tilt : {0.0, 0.75 * kPi, -0.25 * kPi, 1.75 * kPi, kPi})
    for (double slant : {0.0, 0.5, 0.5 * kPi}) {
      const DistantScene scene = distant_scene("sphere", 24, {0.4, 0.6});
      const TsaiShahEstimate estimate =
          shade_tsai_shah(scene.intensity, {.light = {tilt, slant}, .iterations = 10000});
      for (double z : estimate.depth.values) ASSERT_LT(std::abs(z), 1e6) << tilt << " " << slant;
    }
}

TEST(TsaiShah, BoundsAreChecked) {
  EXPECT_NO_THROW(TsaiShahOptions().check());
  EXPECT_THROW((TsaiShahOptions{.light = {}, .iterations = 0}.check()), UsageError);
  EXPECT_THROW((TsaiShahOptions{.light = {NAN, 0}}.check()), UsageError);
}

// What leaks through a mask's rim is as small a part of a coarse level as of the frame.
TEST(LogRangeFit, MisfitIsTheFramesShareOfWhatAMaskHasMissed) {
  constexpr int kSide = 16, kLevels = 3, kStray = 4;
  constexpr float kBrighter = 1.5F, kVariance = 1e-4F;
  ShadedImage image{Plane(kSide, kSide, 1), Plane(kSide, kSide, kVariance), Mask(kSide, kSide, 1),
                    ray_grid({.width = kSide, .height = kSide, .fx = kSide, .fy = kSide})};
  for (int y = 0; y < kSide; ++y)
    for (int x = kSide / 2; x < kSide; ++x) image.inside.at(x, y) = 0;
  const int seen = kSide * kSide / 2;
  image.inside.at(kSide - 1, kStray) = 1;
  image.intensity.at(kSide - 1, kStray) = kBrighter;
  for (int level = 0; level < kLevels; ++level) {
    Plane v(image.rays.width, image.rays.height);  // ln r = 0: of brightness 1
    const double misfit = fit_log_range(image, {.outer_steps = 0}, v).misfit;
    EXPECT_NEAR(misfit, (kBrighter - 1) / std::sqrt(seen + 1.0), 1e-6) << "level " << level;
    image = halved(image);
  }
}

}  // namespace

// Whatever comes in, what goes out is finite and bounded, and never much worse than a flat plane.
namespace {

Intrinsics camera_of(int width, int height) {
  Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = std::max(width, height);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

void expect_sane(const Plane& intensity, const std::string& what) {
  const Mask inside(intensity.width, intensity.height, 1);
  const RangeEstimate near =
      shade_laparoscope(intensity, inside, camera_of(intensity.width, intensity.height), {});
  EXPECT_TRUE(all_finite(near.log_range)) << what;
  for (float v : near.log_range.values) ASSERT_LT(std::abs(v), 50) << what;
}

TEST(ShadingStress, ConstantBlackSaturatedAndTinyImages) {
  expect_sane(Plane(40, 30, 0.5F), "constant");
  expect_sane(Plane(40, 30, 0.0F), "black");
  expect_sane(Plane(40, 30, 1.0F), "saturated");
  expect_sane(Plane(64, 1, 0.7F), "one row");
  expect_sane(Plane(1, 64, 0.7F), "one column");
  expect_sane(Plane(1, 1, 0.7F), "one pixel");
  expect_sane(Plane(3, 2, 0.7F), "six pixels");
}

TEST(ShadingStress, NotFinitePixelsDoNotCount) {
  NearScene scene = near_scene(0.5, 64);
  scene.intensity.at(20, 20) = std::numeric_limits<float>::quiet_NaN();
  scene.intensity.at(40, 30) = std::numeric_limits<float>::infinity();
  scene.intensity.at(10, 50) = -3;
  const RangeEstimate estimate =
      shade_laparoscope(scene.intensity, Mask(64, 64, 1), scene.camera, {});
  EXPECT_LT(relative_error_percent(estimate.log_range, scene.log_range), 0.5);
  expect_sane(Plane(20, 20, std::numeric_limits<float>::quiet_NaN()), "all NaN");
}

TEST(ShadingStress, GainDoesNotMatter) {
  const NearScene scene = near_scene(0.5, 64);
  const RangeEstimate usual = shade_laparoscope(scene.intensity, Mask(64, 64, 1), scene.camera, {});
  for (float gain : {1e-6F, 1e6F}) {
    Plane other = scene.intensity;
    for (float& value : other.values) value *= gain;
    const RangeEstimate estimate = shade_laparoscope(other, Mask(64, 64, 1), scene.camera, {});
    EXPECT_LT(largest_difference(estimate.log_range, usual.log_range), 1e-3) << gain;
  }
}

}  // namespace
}  // namespace organbake
