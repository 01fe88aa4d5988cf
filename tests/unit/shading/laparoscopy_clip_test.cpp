// SPDX-License-Identifier: GPL-3.0-or-later
// The phantom's frames, with texture, highlights, noise, vignette and an instrument, against truth.
#include <gmock/gmock.h>

#include "known_depth.h"
#include "organbake/core/random.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {
namespace {

struct Shares {
  double recall = 0, false_alarm = 0, instrument = 0;
};

Shares mask_shares(const PreparedFrame& frame, const LaparoscopyFrame& truth) {
  double highlights = 0, hit = 0, clean = 0, taken = 0, steel = 0, found = 0;
  for (std::size_t k = 0; k < frame.field.size(); ++k) {
    if (!frame.field.values[k]) continue;
    const bool masked = !frame.diffuse.values[k];
    if (truth.instrument.values[k]) {
      ++steel;
      found += frame.instruments.values[k] != 0;
    } else if (truth.highlights.values[k]) {
      ++highlights;
      hit += masked;
    } else {
      ++clean;
      taken += masked;
    }
  }
  return {hit / std::max(1.0, highlights), taken / std::max(1.0, clean),
          found / std::max(1.0, steel)};
}

double error_percent(const FrameDepth& depth, const PreparedFrame& frame,
                     const LaparoscopyFrame& truth) {
  double shift = 0, count = 0, sum = 0;
  for (int pass = 0; pass < 2; ++pass)
    for (std::size_t k = 0; k < depth.depth.size(); ++k) {
      if (!frame.diffuse.values[k] || !std::isfinite(truth.depth_mm.values[k])) continue;
      const double ratio = std::log(depth.depth.values[k] / truth.depth_mm.values[k]);
      if (pass == 0) {
        shift += ratio;
        ++count;
      } else {
        sum += std::abs(std::exp(ratio - shift / count) - 1);
      }
    }
  return 100 * sum / count;
}

// Noise also moves the rims of the masks, and so what counts of the pixels there.
TEST(LaparoscopyClip, AStillSceneKeepsItsDepth) {
  const LaparoscopyFrame scene =
      LaparoscopyPhantom({.width = 480, .height = 360, .frames = 2}).frame(0);
  const auto shaded = [&](std::uint64_t seed, const FrameDepth* previous) {
    Rgb8Image image = scene.image;
    RandomStream random(seed);
    for (std::uint8_t& level : image.pixels)
      level = std::uint8_t(std::clamp(std::lround(level + random.normal()), 0L, 255L));
    return shade_frame(prepare_frame(image, scene.camera.intrinsics, {}), {}, previous);
  };
  const FrameDepth first = shaded(1, nullptr), second = shaded(2, &first);
  EXPECT_EQ(second.refinements, 0);
  EXPECT_EQ(second.range.log_range, first.range.log_range);
}

TEST(LaparoscopyClip, DepthMasksAndWarmStart) {
  const LaparoscopyPhantom phantom({.width = 480, .height = 360, .frames = 3});
  double error = 0;
  Shares mean;
  FrameDepth previous;
  for (int i = 0; i < 3; ++i) {
    const LaparoscopyFrame truth = phantom.frame(i);
    const PreparedFrame frame = prepare_frame(truth.image, truth.camera.intrinsics, {});
    FrameDepth depth = shade_frame(frame, {}, i > 0 ? &previous : nullptr);
    error += error_percent(depth, frame, truth) / 3;
    const Shares shares = mask_shares(frame, truth);
    mean.recall += shares.recall / 3;
    mean.false_alarm += shares.false_alarm / 3;
    mean.instrument += shares.instrument / 3;
    EXPECT_EQ(depth.warm, i > 0);
    EXPECT_FALSE(depth.metric);
    previous = std::move(depth);
  }
  EXPECT_LT(error, 3.0);
  EXPECT_GT(mean.recall, 0.90);
  EXPECT_LT(mean.false_alarm, 0.05);
  EXPECT_GT(mean.instrument, 0.80);
}

// Gallbladder and liver differ in colour and in albedo.
TEST(LaparoscopyClip, AlbedoThatGoesWithColourIsNotTakenForShape) {
  constexpr double kMostError = 1.5;     // percent
  constexpr double kWorseWithout = 1.5;  // times: what colour tells is worth using
  for (std::uint64_t seed : {1U, 2U}) {
    const LaparoscopyFrame truth =
        LaparoscopyPhantom({.seed = seed, .width = 320, .height = 240, .two_tissues = true})
            .frame(0);
    const auto error = [&](bool albedo) {
      const PreparedFrame frame =
          prepare_frame(truth.image, truth.camera.intrinsics, {.piecewise_albedo = albedo});
      return error_percent(shade_frame(frame, {}), frame, truth);
    };
    const double with = error(true);
    EXPECT_LT(with, kMostError) << seed;
    EXPECT_GT(error(false), kWorseWithout * with) << seed;
  }
}

TEST(LaparoscopyClip, ConfidenceIsZeroOutsideAndHigherInFront) {
  const LaparoscopyPhantom phantom({.width = 240, .height = 180, .frames = 1});
  const LaparoscopyFrame truth = phantom.frame(0);
  const PreparedFrame frame = prepare_frame(truth.image, truth.camera.intrinsics, {});
  ShadingOptions metric;
  metric.range_mm = 55;
  const FrameDepth depth = shade_frame(frame, metric);
  EXPECT_TRUE(depth.metric);
  EXPECT_EQ(depth.confidence.at(2, 2), 0);
  EXPECT_GT(depth.confidence.at(100, 60), 0.2);
  EXPECT_TRUE(std::isinf(depth.depth.at(2, 2)));
}

TEST(LaparoscopyPhantom, DepthAndNormalsAgreeWithTheHeightField) {
  const LaparoscopyPhantom phantom({.width = 96, .height = 72, .frames = 2});
  const LaparoscopyFrame frame = phantom.frame(1);
  const RigidTransform world_from_camera = frame.camera.camera_from_world.inverse();
  int looked = 0;
  for (int y = 0; y < 72; y += 3)
    for (int x = 0; x < 96; x += 3) {
      const float depth = frame.depth_mm.at(x, y);
      if (!std::isfinite(depth)) continue;
      const Eigen::Vector3d world =
          world_from_camera *
          Eigen::Vector3d(double(depth) * unproject(frame.camera.intrinsics, {x + 0.5, y + 0.5}));
      EXPECT_NEAR(world.z(), phantom.height_mm(world.x(), world.y()), 1e-3);
      EXPECT_LT(frame.normals[frame.depth_mm.index(x, y)].z(), 0);
      ++looked;
    }
  EXPECT_GT(looked, 200);
}

}  // namespace
}  // namespace organbake
