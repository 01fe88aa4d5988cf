// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/distant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
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

constexpr double kDegree = std::numbers::pi / 180;

// Two oblique lights; the bench has four on all surfaces at 128².
TEST(Distant, GaussAndPeaksWithinAPixelAndAHalfAndBetterThanTsaiShah) {
  for (const auto& [name, i] : {std::pair("gauss", 0), std::pair("peaks", 3)}) {
    const DistantLight light{(20 + 90 * i) * kDegree, (30 + 10 * (i % 2) + 10 * (i / 2)) * kDegree};
    const DistantScene scene = distant_scene(name, 128, light);
    DistantOptions options;
    options.light = light;
    const DistantEstimate estimate = shade_distant(scene.intensity, Mask(128, 128, 1), options);
    const double error = depth_error_px(estimate.depth, scene.depth);
    EXPECT_LT(error, 1.5) << name << " " << i;
    EXPECT_LT(error, 0.5 * depth_error_px(Plane(128, 128), scene.depth));
    EXPECT_FALSE(estimate.ambiguous);
    EXPECT_THAT(estimate.branch, testing::AnyOf("flat", "near", "far"));
  }
}

// An occluding rim, which no smooth sheet follows: without it both were 5 to 8 pixels off.
TEST(Distant, SolidsOnAPlainGroundHaveTheirRim) {
  for (const char* name : {"vase", "sphere"})
    for (double noise : {0.0, 0.02}) {
      const DistantLight light{20 * kDegree, 30 * kDegree};
      DistantScene scene = distant_scene(name, 128, light);
      if (noise > 0) add_noise(scene.intensity, noise, /*eight_bit=*/true, 1);
      DistantOptions options;
      options.light = light;
      const DistantEstimate estimate = shade_distant(scene.intensity, Mask(128, 128, 1), options);
      EXPECT_EQ(estimate.branch, "solid") << name << " " << noise;
      EXPECT_LT(depth_error_px(estimate.depth, scene.depth), 1.5) << name << " " << noise;
    }
}

TEST(Distant, SheetsWithoutARimAreNoSolids) {
  for (const char* name : {"gauss", "sombrero", "peaks"}) {
    const DistantLight light{110 * kDegree, 50 * kDegree};
    DistantScene scene = distant_scene(name, 64, light);
    add_noise(scene.intensity, 0.02, /*eight_bit=*/true, 2);
    DistantOptions options;
    options.light = light;
    EXPECT_NE(shade_distant(scene.intensity, Mask(64, 64, 1), options).branch, "solid") << name;
  }
}

TEST(Distant, NoSurfaceIsWorseThanTheFlatPlane) {
  for (const std::string& name : distant_scene_names()) {
    const DistantLight light{110 * kDegree, 40 * kDegree};
    const DistantScene scene = distant_scene(name, 64, light);
    DistantOptions options;
    options.light = light;
    const DistantEstimate estimate = shade_distant(scene.intensity, Mask(64, 64, 1), options);
    EXPECT_LT(depth_error_px(estimate.depth, scene.depth),
              depth_error_px(Plane(64, 64), scene.depth))
        << name;
  }
}

TEST(Distant, SaysThatFrontalLightIsAmbiguous) {
  const DistantScene scene = distant_scene("gauss", 32, {0, 0});
  const DistantEstimate estimate = shade_distant(scene.intensity, Mask(32, 32, 1), {});
  EXPECT_TRUE(estimate.ambiguous);
  EXPECT_TRUE(all_finite(estimate.depth));
}

TEST(Distant, BoundsAreChecked) {
  EXPECT_NO_THROW(DistantOptions().check());
  DistantOptions options;
  options.light.slant_rad = 2;
  EXPECT_THROW(options.check(), UsageError);
  options = {};
  options.albedo = 0;
  EXPECT_THROW(options.check(), UsageError);
}

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

TEST(FastSweeping, RangesKeptInEitherPrecisionAgree) {
  const NearScene scene = near_scene(0.5, 48);
  Plane logs = scene.intensity;
  for (float& value : logs.values) value = std::log(value);
  Plane single = farthest_log_range(logs);
  Grid<double> exact(logs.width, logs.height);
  for (std::size_t k = 0; k < exact.size(); ++k) exact.values[k] = single.values[k];
  const Mask inside(logs.width, logs.height, 1);
  constexpr int kMostSweeps = 200;
  constexpr double kTolerance = 1e-6;
  sweep_log_range(logs, inside, ray_grid(scene.camera), single, kMostSweeps, kTolerance);
  sweep_log_range(logs, inside, ray_grid(scene.camera), exact, kMostSweeps, kTolerance);
  // Rounding moves a pixel by 1e-7; where the upwind neighbour changes with it, by more.
  constexpr double kAgree = 1e-3;
  for (std::size_t k = 0; k < exact.size(); ++k)
    ASSERT_NEAR(single.values[k], exact.values[k], kAgree) << k;
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
  const DistantEstimate far = shade_distant(intensity, inside, {});
  EXPECT_TRUE(all_finite(far.depth)) << what;
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

// Tilts all round, each with the next of the slants, the singular ones among them.
TEST(ShadingStress, DistantLightsFromEverywhere) {
  constexpr std::array kSlants = {0.0, 0.4, 1.0, 0.5 * std::numbers::pi};
  for (std::size_t tilt = 0; tilt < 8; ++tilt) {
    const double slant = kSlants[tilt % kSlants.size()];
    const DistantLight light{static_cast<double>(tilt) * 0.25 * std::numbers::pi, slant};
    const DistantScene scene = distant_scene("gauss", 32, light);
    DistantOptions options;
    options.light = light;
    const DistantEstimate estimate = shade_distant(scene.intensity, Mask(32, 32, 1), options);
    ASSERT_TRUE(all_finite(estimate.depth));
    // Under frontal light hill and hollow look alike: no error can be promised there.
    if (slant == 0) continue;
    EXPECT_LT(depth_error_px(estimate.depth, scene.depth),
              1.1 * depth_error_px(Plane(32, 32), scene.depth))
        << tilt << " " << slant;
  }
}

}  // namespace
}  // namespace organbake
