// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/prepared_frame.h"
#include "support/places.h"
#include "support/testing.h"

namespace organbake {

// A depth says whether its picture supports it, and is no worse than a flat plane when it does not.
namespace {

FrameDepth shaded(const Rgb8Image& image, const Intrinsics& camera) {
  return shade_frame(prepare_frame(image, camera, {}), {});
}

// The largest deviation of depth from its mean, relative.
double relief_of(const Plane& depth) {
  double sum = 0, count = 0, largest = 0;
  for (int pass = 0; pass < 2; ++pass)
    for (float z : depth.values) {
      if (!std::isfinite(z)) continue;
      if (pass == 0) sum += z, ++count;
      if (pass == 1) largest = std::max(largest, std::abs(z * count / sum - 1));
    }
  return largest;
}

// A wall across the axis in patches of two albedos but one colour: no shape has such edges.
Rgb8Image patched_wall(const Intrinsics& camera) {
  Rgb8Image image(camera.width, camera.height);
  RandomStream random(4);
  constexpr int kPatch = 24;
  std::vector<double> albedo(1000);
  for (double& value : albedo) value = random.below(2) ? 1 : 0.45;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = unproject(camera, {x + 0.5, y + 0.5});
      const double light = albedo[std::size_t(y / kPatch) * 31 + std::size_t(x / kPatch)] /
                           std::pow(ray.squaredNorm(), 1.5);
      const double tint[3] = {0.8, 0.35, 0.3};
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = srgb8_from_linear(static_cast<float>(light * tint[c]));
    }
  return image;
}

TEST(DepthVerdict, RenderedTissueIsOkAndKeepsItsRelief) {
  for (int seed : {1, 2}) {
    const LaparoscopyPhantom phantom(
        {.seed = static_cast<std::uint64_t>(seed), .width = 320, .height = 240});
    const LaparoscopyFrame frame = phantom.frame(0);
    const FrameDepth depth = shaded(frame.image, frame.camera.intrinsics);
    EXPECT_EQ(depth.quality.verdict, DepthVerdict::ok) << depth.quality.reason;
    EXPECT_GT(relief_of(depth.depth), 0.05);
  }
}

TEST(DepthVerdict, PatchesOfAlbedoAreDoubtfulAndNearFlat) {
  const Intrinsics camera = assumed_camera(320, 240, 1.2);
  const FrameDepth depth = shaded(patched_wall(camera), camera);
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::doubtful);
  EXPECT_THAT(depth.quality.reason, testing::HasSubstr("texture"));
  constexpr double kNearFlat = 0.035;  // a third of what is invented: its tilt is kept
  EXPECT_LT(relief_of(depth.depth), kNearFlat);
  EXPECT_GT(relief_of(depth_from_log_range(depth.range.log_range, ray_grid(camera),
                                           Mask(camera.width, camera.height, 1))),
            0.1)
      << "what is invented";
}

// A straight tube of radius 1 with its end 8 away, seen from its axis under a lamp at the lens,
// with a fifth of texture; ln of planar z beside it.
struct SeenTube {
  Rgb8Image image;
  Plane log_z;
};
SeenTube seen_tube(const Intrinsics& camera) {
  constexpr double kEnd = 8, kTexture = 0.2;
  SeenTube tube{Rgb8Image(camera.width, camera.height), Plane(camera.width, camera.height)};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = unproject(camera, {x + 0.5, y + 0.5});
      const double off_axis = ray.head<2>().norm(), z = std::min(kEnd, 1 / off_axis);
      const double cosine = (z < kEnd ? off_axis : 1) / ray.norm();
      const double albedo = 1 + kTexture * std::sin(9 * ray.x()) * std::cos(11 * ray.y());
      const double light = 0.25 * albedo * cosine / (z * z * ray.squaredNorm());
      const double tint[3] = {0.8, 0.35, 0.3};
      for (int c = 0; c < 3; ++c)
        tube.image.at(x, y)[c] = srgb8_from_linear(static_cast<float>(8 * light * tint[c]));
      tube.log_z.at(x, y) = static_cast<float>(std::log(z));
    }
  return tube;
}

// Mean of |ln z − truth|, the best shift taken out; of a plane without `depth`.
double log_error(const Plane& truth, const Plane* depth) {
  std::vector<double> off;
  for (std::size_t k = 0; k < truth.size(); ++k)
    if (!depth || std::isfinite(depth->values[k]))
      off.push_back((depth ? std::log(depth->values[k]) : 0) - truth.values[k]);
  const double middle = median(std::vector<double>(off));
  double sum = 0;
  for (const double value : off) sum += std::abs(value - middle) / static_cast<double>(off.size());
  return sum;
}

// What is dark in the middle is far: no beam and no vignette makes it so.
TEST(DepthVerdict, ATubeKeepsItsDepth) {
  const Intrinsics camera = assumed_camera(200, 150, 1.4);
  const SeenTube tube = seen_tube(camera);
  const FrameDepth depth = shaded(tube.image, camera);
  constexpr double kOfAPlanes = 0.6;
  EXPECT_LT(log_error(tube.log_z, &depth.depth), kOfAPlanes * log_error(tube.log_z, nullptr));
}

TEST(DepthVerdict, AUserSetsTheShareOfTheRelief) {
  const Intrinsics camera = assumed_camera(200, 150, 1.4);
  const PreparedFrame frame = prepare_frame(seen_tube(camera).image, camera, {});
  ShadingOptions options;
  const auto relief = [&](double share) {
    options.relief = share;
    return relief_of(shade_frame(frame, options).depth);
  };
  EXPECT_LT(relief(0), 1e-3) << "a plane across the axis";
  EXPECT_GT(relief(1), relief(0.5));
  options.relief = 1.5;
  EXPECT_THROW(options.check(), UsageError);
}

TEST(DepthVerdict, DarknessIsAFailure) {
  const FrameDepth depth = shaded(Rgb8Image(160, 120), assumed_camera(160, 120, 1.2));
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::failed);
  EXPECT_FALSE(depth.quality.reason.empty());
}

TEST(DepthVerdict, ARealFrameWithoutTruthIsNotTrusted) {
  const std::filesystem::path clip = shared_data("video/laparoscopy_720p_25fps.mp4");
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << "real data is missing: " << clip;
  VideoReader reader(clip);
  StoredPicture frame;
  ASSERT_TRUE(reader.next(frame));
  const FrameDepth depth =
      shade_frame(prepare_frame(frame, assumed_camera(1280, 720, 1.22), {.halvings = 1}), {});
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::doubtful);
}

}  // namespace

// The evidence measures what it says on reliefs and hues made for it, and the share follows it.
// How good the share is, the acceptance test Relief tells.
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
  EXPECT_NEAR(relief_evidence(tilted.frame, tilted.estimate).bowl, 0, kClose);
  EXPECT_GT(relief_evidence(bowl.frame, bowl.estimate).bowl, 0.05);
  const Made lumen = made([](double u, double v) { return -u * u - v * v; }, kOneHue);
  const ReliefEvidence hollow = relief_evidence(lumen.frame, lumen.estimate);
  EXPECT_LT(hollow.bowl, -0.05);
  EXPECT_NEAR(hollow.rest_sd, 0, kClose);
  EXPECT_GT(relief_share(hollow).bowl,
            relief_share(relief_evidence(bowl.frame, bowl.estimate)).bowl)
      << "a beam feigns the one, nothing the other";
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
  keep_relief(rays, m.frame.tissue, {.tilt = 1, .bowl = 0, .rest = 0}, kept);
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
