// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/stereo_depth.h"

#include "disparity.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/grid_filters.h"
#include "stereo_scene.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

// Of the issue: what a stereo laparoscope must reach on rendered tissue.
constexpr double kMostError = 0.01, kMostBad = 0.03;
// What is left out must be little, or the errors above say nothing. A tenth of the left eye's round
// view lies outside the right one's at 40 mm.
constexpr double kDense = 0.8;

// Rendered once for all tests that need no finer picture.
struct SmallPair {
  LaparoscopyFrame left, right;
  Rectifier rectifier;
};
const SmallPair& small_pair() {
  static const SmallPair pair = [] {
    const LaparoscopyPhantom phantom(stereo_scene(360, 288));
    return SmallPair{phantom.frame(0), phantom.right_frame(0), Rectifier(rig_of(phantom))};
  }();
  return pair;
}

TEST(StereoDepth, TheNearestTissueMustBeNearerThanTheFarthest) {
  EXPECT_NO_THROW(StereoOptions{}.check());
  EXPECT_THROW((StereoOptions{.nearest_mm = 50, .farthest_mm = 40}.check()), UsageError);
}

TEST(StereoDepth, TissueUnderALaparoscopeIsMeasured) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const LaparoscopyPhantom phantom(stereo_scene(720, 576, seed));
    const LaparoscopyFrame left = phantom.frame(0), right = phantom.right_frame(0);
    const Rectifier rectifier(rig_of(phantom));
    PreparedFrame prepared;
    const StereoDepth found = depth_of_pair(rectifier, left.image, right.image, &prepared);
    const DepthErrors errors = errors_of(found.depth.depth, left.depth_mm, prepared.tissue);
    EXPECT_LT(errors.mean, kMostError) << seed;
    EXPECT_LT(errors.bad, kMostBad) << seed;
    EXPECT_GT(errors.dense, kDense) << seed;
    EXPECT_EQ(found.depth.quality.verdict, DepthVerdict::ok) << found.depth.quality.reason;
    EXPECT_TRUE(found.depth.metric);
  }
}

// Each square of so many pixels has the colour of its first one.
Rgb8Image mosaic(const Rgb8Image& image, int side) {
  Rgb8Image result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::copy_n(image.at(x - x % side, y - y % side), 3, result.at(x, y));
  return result;
}

TEST(StereoDepth, OfAMosaicIsDoubted) {
  const SmallPair& eyes = small_pair();
  const Rgb8Image left = mosaic(eyes.left.image, 8), right = mosaic(eyes.right.image, 8);
  const PreparedEyes ready = prepare_eyes(left, right, eyes.rectifier, {});
  EXPECT_EQ(ready.left.squares_px, 8);
  const StereoDepth found = stereo_depth(ready.left, ready.right, eyes.rectifier.eyes(), {});
  EXPECT_NE(found.depth.quality.verdict, DepthVerdict::ok);
  EXPECT_EQ(prepare_eyes(eyes.left.image, eyes.right.image, eyes.rectifier, {}).left.squares_px, 1);
}

TEST(StereoDepth, WhatIsLaidOverAnEyeHasNoDepth) {
  const SmallPair& eyes = small_pair();
  Rgb8Image left = eyes.left.image;
  EyeInsets insets{Mask(left.width, left.height), {}};
  for (int y = 120; y < 160; ++y)
    for (int x = 150; x < 210; ++x) {
      std::fill_n(left.at(x, y), 3, std::uint8_t(x / 6 % 2 ? 220 : 40));
      insets.left.at(x, y) = 1;
    }
  const PreparedEyes ready = prepare_eyes(left, eyes.right.image, eyes.rectifier, {}, true, insets);
  const StereoDepth found = stereo_depth(ready.left, ready.right, eyes.rectifier.eyes(), {});
  for (int y = 120; y < 160; ++y)
    for (int x = 150; x < 210; ++x) EXPECT_FALSE(std::isfinite(found.depth.depth.at(x, y)));
}

TEST(StereoDepth, SwappedEyesAreFound) {
  const SmallPair& eyes = small_pair();
  EXPECT_THAT(message_of(ExitCode::bad_data,
                         [&] { depth_of_pair(eyes.rectifier, eyes.right.image, eyes.left.image); }),
              testing::HasSubstr("swapped"));
  EXPECT_NO_THROW(depth_of_pair(eyes.rectifier, eyes.left.image, eyes.right.image));
}

Rgb8Image lowered(const Rgb8Image& image, int rows) {
  Rgb8Image result(image.width, image.height);
  for (int y = rows; y < image.height; ++y)
    std::copy_n(image.at(0, y - rows), 3 * std::size_t(image.width), result.at(0, y));
  return result;
}

TEST(PreparedEyes, RowsThatAreApartAreBroughtTogether) {
  const Rectifier& rectifier = small_pair().rectifier;
  const LaparoscopyFrame& left = small_pair().left;
  const Rgb8Image& right = small_pair().right.image;
  EXPECT_FALSE(prepare_eyes(left.image, right, rectifier, {}).corrected.needed());
  const PreparedEyes apart = prepare_eyes(left.image, lowered(right, 3), rectifier, {});
  EXPECT_NEAR(apart.corrected.shift_px, 3, 0.1);
  EXPECT_NEAR(apart.corrected.roll_rad, 0, 1e-3);
  const StereoDepth found = stereo_depth(apart.left, apart.right, rectifier.eyes(), {});
  const DepthErrors errors = errors_of(found.depth.depth, left.depth_mm, apart.left.tissue);
  EXPECT_LT(errors.mean, kMostError);
  EXPECT_GT(errors.dense, kDense);
  EXPECT_EQ(found.depth.quality.verdict, DepthVerdict::ok) << found.depth.quality.reason;
}

TEST(StereoDepth, ADarkRimIsNotMissed) {
  const SmallPair& eyes = small_pair();
  const auto dimmed = [](Rgb8Image image) {
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const double radius = std::hypot(x - 180, y - 144) / 144;
        for (int c = 0; c < 3; ++c)
          image.at(x, y)[c] = static_cast<std::uint8_t>(
              std::max(17.0 * (image.at(x, y)[c] > 16),
                       image.at(x, y)[c] * std::clamp(1.8 - 2 * radius, 0.0, 1.0)));
      }
    return image;
  };
  const StereoDepth found =
      depth_of_pair(eyes.rectifier, dimmed(eyes.left.image), dimmed(eyes.right.image));
  EXPECT_EQ(found.depth.quality.verdict, DepthVerdict::ok) << found.depth.quality.reason;
  EXPECT_GT(found.covered_share, 0.75);
  EXPECT_LT(found.lit_share, 0.9);
}

// A lit wall without texture over two thirds of both pictures; each eye has noise of its own.
Rgb8Image mostly_bare(Rgb8Image image, std::uint64_t seed) {
  RandomStream random(seed);
  for (int y = 0; y < image.height; ++y)
    for (int x = image.width / 3; x < image.width; ++x)
      for (int c = 0; c < 3 && image.at(x, y)[0] > 16; ++c)
        image.at(x, y)[c] = static_cast<std::uint8_t>(std::lround(140 + 1.3 * random.normal()));
  return image;
}

// That little is found again says nothing of whether it is right; that as much is found where
// nothing is to be found does.
TEST(StereoDepth, OfALittleThatIsNoChanceIsOk) {
  const SmallPair& eyes = small_pair();
  const StereoDepth little = depth_of_pair(eyes.rectifier, mostly_bare(eyes.left.image, 1),
                                           mostly_bare(eyes.right.image, 2));
  EXPECT_EQ(little.depth.quality.verdict, DepthVerdict::ok) << little.depth.quality.reason;
  EXPECT_LT(little.covered_share, 0.5);
  EXPECT_LT(little.chance_share, 0.2);
  Rgb8Image other = eyes.right.image;  // upside down: of nothing that the left eye sees
  for (int y = 0; y < other.height; ++y)
    std::copy_n(eyes.right.image.at(0, other.height - 1 - y), 3 * std::size_t(other.width),
                other.at(0, y));
  EXPECT_EQ(depth_of_pair(eyes.rectifier, eyes.left.image, other).depth.quality.verdict,
            DepthVerdict::failed);
  // One eye's picture twice: all of it at infinity, and a little by chance before.
  EXPECT_EQ(depth_of_pair(eyes.rectifier, eyes.left.image, eyes.left.image).depth.quality.verdict,
            DepthVerdict::failed);
}

constexpr int kWidth = 120, kHeight = 60;

// A plane that is known but for two upright gaps, 6 and 20 px wide, and the right border.
Disparity plane_with_gaps() {
  Disparity plane{Plane(kWidth, kHeight), Mask(kWidth, kHeight, 1)};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      plane.known.at(x, y) = !((x >= 20 && x < 26) || (x >= 50 && x < 70) || x >= 110);
      plane.px.at(x, y) = plane.known.at(x, y) ? 30 + 0.1F * x : 0;
    }
  return plane;
}

double share_of_columns(const Mask& mask, int from, int to) {
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = from; x < to; ++x) sum += mask.at(x, y);
  return sum / ((to - from) * kHeight);
}

TEST(CloseGaps, ThoseThatAreNarrowerThanTheWidth) {
  const Mask all(kWidth, kHeight, 1);
  double before = -1;
  for (const auto& [width_px, narrow, wide] :
       {std::tuple{0.0, 0.0, 0.0}, {4.0, 0.0, 0.0}, {8.0, 1.0, 0.0}, {24.0, 1.0, 1.0}}) {
    Disparity disparity = plane_with_gaps();
    const Mask filled = close_gaps(all, width_px, disparity);
    EXPECT_NEAR(share_of_columns(filled, 20, 26), narrow, 0.3 * narrow) << width_px;
    EXPECT_NEAR(share_of_columns(filled, 50, 70), wide, 0.5 * wide) << width_px;
    EXPECT_EQ(share_of_columns(filled, 110, kWidth), 0) << "no gap: nothing is known beyond";
    const double in_all = share_of_columns(filled, 0, kWidth);
    EXPECT_GE(in_all, before);
    before = in_all;
    for (int x = 0; x < kWidth; ++x) {
      if (!filled.at(x, 30)) continue;
      EXPECT_NEAR(disparity.px.at(x, 30), 30 + 0.1F * static_cast<float>(x), 0.05);
    }
  }
}

TEST(CloseGaps, NotBetweenTwoDepthsNorWhereNoTissueIs) {
  Disparity step = plane_with_gaps();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 23; x < kWidth; ++x) step.px.at(x, y) += 15;
  EXPECT_LT(share_of_columns(close_gaps(Mask(kWidth, kHeight, 1), 8, step), 20, 26), 0.1);
  Disparity plane = plane_with_gaps();
  EXPECT_EQ(share_of_columns(close_gaps(Mask(kWidth, kHeight), 8, plane), 0, kWidth), 0);
}

// A slope with a step in the middle, and noise as wide as a matched window, of a known deviation.
TEST(SmoothDisparity, LeavesStepsAndTakesNoise) {
  constexpr float kSd_px = 0.1F, kStep_px = 3;
  RandomStream random(7);
  Plane white(kWidth, kHeight), truth(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      white.at(x, y) = static_cast<float>(random.normal());
      truth.at(x, y) = 30 + 0.05F * static_cast<float>(x) + (x < kWidth / 2 ? 0 : kStep_px);
    }
  const Mask all(kWidth, kHeight, 1);
  const Plane wide = box_mean(white, all, 2);  // of 25: a fifth of its deviation
  Disparity disparity{truth, all};
  for (std::size_t k = 0; k < truth.size(); ++k)
    disparity.px.values[k] += 5 * kSd_px * wide.values[k];
  smooth_disparity(Plane(kWidth, kHeight, kSd_px), disparity);
  double flat = 0, flat_count = 0, beside = 0, beside_count = 0;
  for (int y = 8; y < kHeight - 8; ++y)
    for (int x = 8; x < kWidth - 8; ++x) {
      const double off = disparity.px.at(x, y) - truth.at(x, y);
      const int away = std::abs(x - kWidth / 2);
      if (away > 24) flat += off * off, ++flat_count;
      if (away < 6) beside += std::abs(off), ++beside_count;
    }
  EXPECT_LT(std::sqrt(flat / flat_count), 0.3 * kSd_px) << "a third is left by a window of 9²";
  EXPECT_LT(beside / beside_count, 0.15 * kStep_px)
      << "a plane through the step is off by a quarter";
}

// Learned from what stereo finds in a few frames of a clip, as the stage does.
BeamEstimate learned(double beam_exponent, std::uint64_t seed, int frames) {
  LaparoscopyOptions options = stereo_scene(480, 384, seed);
  options.frames = frames;
  options.beam_exponent = beam_exponent;
  const LaparoscopyPhantom phantom(options);
  const Rectifier rectifier(rig_of(phantom));
  std::vector<BeamRings> rings;
  for (int i = 0; i < frames; ++i) {
    PreparedFrame left;
    const StereoDepth found =
        depth_of_pair(rectifier, phantom.frame(i).image, phantom.right_frame(i).image, &left);
    rings.push_back(beam_rings(left, found.depth.depth, found.depth.confidence));
  }
  return estimate_beam(rings);
}

// The phantom's own vignette of 5 % at the rim, 34° off the axis, is part of what is learned.
constexpr double kVignette = 0.27;

TEST(Beam, IsLearnedWithAnUncertaintyThatHolds) {
  constexpr double kMostOff = 0.6, kSigmas = 3;
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const double exponent : {0.0, 4.0}) {
      const BeamEstimate beam = learned(exponent, seed, 2);
      const double off = std::abs(beam.exponent - exponent - kVignette);
      EXPECT_LT(off, kMostOff) << seed << ", cos^" << exponent << ": " << beam.exponent;
      EXPECT_LT(off, kSigmas * beam.sd + 0.1) << beam.exponent << " ± " << beam.sd;
      EXPECT_TRUE(beam.told() || exponent == 0) << beam.exponent << " ± " << beam.sd;
    }
  }
}

TEST(Beam, IsNotToldByNothing) {
  EXPECT_FALSE(estimate_beam({}).told());
  EXPECT_EQ(estimate_beam({}).sectors, 0);
  EXPECT_FALSE((BeamEstimate{.exponent = 1, .sd = 0.6, .sectors = 8}.told()));
  EXPECT_FALSE((BeamEstimate{.exponent = 4, .sd = 0.9, .sectors = 8}.told()));
  EXPECT_FALSE((BeamEstimate{.exponent = 4, .sd = 0.1, .sectors = 3}.told()));
  EXPECT_TRUE((BeamEstimate{.exponent = 4, .sd = 0.1, .sectors = 8}.told()));
}

// lighting.json as a calibration file: out and back.
TEST(Beam, PassesThroughALightingFile) {
  for (const double exponent : {0.0, 0.5, 2.0, 6.5}) {
    const LaparoscopeOptions lamp{
        .light_offset_x_mm = 2.5, .light_offset_y_mm = -1, .beam_exponent = exponent};
    const LaparoscopeOptions back =
        lamp_of(lighting_from_json(lighting_to_json(laparoscope_lighting(lamp)), "it"), "it");
    EXPECT_NEAR(back.beam_exponent, exponent, 1e-6);
    EXPECT_NEAR(back.light_offset_x_mm, 2.5, 1e-9);
    EXPECT_NEAR(back.light_offset_y_mm, -1, 1e-9);
  }
}

}  // namespace
}  // namespace organbake
