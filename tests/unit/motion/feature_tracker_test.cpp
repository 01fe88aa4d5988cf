// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/feature_tracker.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

// Blotches of several sizes that never repeat, moved by this many pixels.
Grid<std::uint8_t> blotches(double right, double down) {
  RandomStream random(11, 0);
  Plane light(320, 240, 128);
  constexpr int kBlotches = 1200;
  for (int i = 0; i < kBlotches; ++i) {
    const double cx = 360 * random.uniform() - 20 + right, cy = 280 * random.uniform() - 20 + down;
    const double radius = 2 + 6 * random.uniform(), height = 60 * (random.uniform() - 0.5);
    const int reach = static_cast<int>(3 * radius);
    for (int y = std::max(0, int(cy) - reach); y < std::min(240, int(cy) + reach); ++y)
      for (int x = std::max(0, int(cx) - reach); x < std::min(320, int(cx) + reach); ++x)
        light.at(x, y) +=
            static_cast<float>(height * std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) /
                                                 (2 * radius * radius)));
  }
  Grid<std::uint8_t> picture(320, 240);
  for (std::size_t k = 0; k < picture.size(); ++k)
    picture.values[k] = static_cast<std::uint8_t>(std::clamp(light.values[k], 0.0F, 255.0F));
  return picture;
}

TEST(FeatureTracker, FollowsMotionToAFractionOfAPixel) {
  FeatureTracker tracker({.features = 200});
  const Mask all(320, 240, 1);
  for (int frame = 0; frame < 8; ++frame) tracker.add(blotches(1.3 * frame, 0.7 * frame), all);
  const ClipTracks clip = tracker.take();
  std::size_t whole = 0, right = 0;
  for (const FeatureTrack& track : clip.tracks) {
    if (track.first_frame != 0 || track.end_frame() != 8) continue;
    ++whole;
    const Eigen::Vector2f moved = track.at(7) - track.at(0);
    right += (moved - Eigen::Vector2f(9.1F, 4.9F)).norm() < 0.5F;
  }
  EXPECT_GT(whole, 50u);
  EXPECT_GE(right, whole * 95 / 100) << "a feature at a blotch's slope may slide along it";
  EXPECT_EQ(clip.shots, std::vector<std::size_t>{0});
}

TEST(FeatureTracker, KeepsToWhatIsUsable) {
  FeatureTracker tracker({.features = 200});
  Mask left(320, 240);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 160; ++x) left.at(x, y) = 1;
  for (int frame = 0; frame < 4; ++frame) tracker.add(blotches(2.0 * frame, 0), left);
  for (const FeatureTrack& track : tracker.take().tracks)
    for (const Eigen::Vector2f& pixel : track.pixels) EXPECT_LT(pixel.x(), 161);
}

TEST(FeatureTracker, SeesACut) {
  FeatureTracker tracker({.features = 300});
  const Mask all(320, 240, 1);
  for (int frame = 0; frame < 4; ++frame) tracker.add(blotches(frame, 0), all);
  RandomStream random(5, 0);
  Grid<std::uint8_t> other(320, 240);
  for (auto& value : other.values) value = static_cast<std::uint8_t>(255 * random.uniform());
  for (int frame = 0; frame < 2; ++frame) tracker.add(other, all);
  EXPECT_EQ(tracker.take().shots, (std::vector<std::size_t>{0, 4}));
}

TEST(FeatureTracker, RefusesFramesOfAnotherSize) {
  FeatureTracker tracker;
  tracker.add(blotches(0, 0), Mask(320, 240, 1));
  EXPECT_THROW(tracker.add(Grid<std::uint8_t>(100, 100), Mask(100, 100, 1)), BadDataError);
}

}  // namespace
}  // namespace organbake
