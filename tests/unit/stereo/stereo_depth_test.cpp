// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/stereo_depth.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "organbake/core/error.h"
#include "stereo_scene.h"
#include "support/error_message.h"

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

TEST(StereoDepth, TheDefaultsAreValidAndEachBoundIsTold) {
  EXPECT_NO_THROW(StereoOptions{}.check());
  EXPECT_THROW((StereoOptions{.nearest_mm = 0}.check()), UsageError);
  EXPECT_THROW((StereoOptions{.nearest_mm = 50, .farthest_mm = 40}.check()), UsageError);
  EXPECT_THROW((StereoOptions{.reach = 0.5}.check()), UsageError);
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

}  // namespace
}  // namespace organbake
