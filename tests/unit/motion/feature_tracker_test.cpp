// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/feature_tracker.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

// Blotches of two sizes, moved by this many pixels.
Grid<std::uint8_t> blotches(double right, double down, int phase = 0) {
  Grid<std::uint8_t> picture(320, 240);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const double u = x - right, v = y - down;
      const double value = 128 + 40 * std::sin(0.31 * u + 1.7 * std::sin(0.05 * v) + phase) +
                           40 * std::sin(0.27 * v + 2.1 * std::sin(0.06 * u + phase));
      picture.at(x, y) = static_cast<std::uint8_t>(value);
    }
  return picture;
}

TEST(FeatureTracker, FollowsMotionToAFractionOfAPixel) {
  FeatureTracker tracker({.features = 200});
  const Mask all(320, 240, 1);
  for (int frame = 0; frame < 8; ++frame) tracker.add(blotches(1.3 * frame, 0.7 * frame), all);
  const ClipTracks clip = tracker.take();
  std::size_t whole = 0;
  for (const FeatureTrack& track : clip.tracks) {
    if (track.first_frame != 0 || track.end_frame() != 8) continue;
    ++whole;
    const Eigen::Vector2f moved = track.at(7) - track.at(0);
    EXPECT_NEAR(moved.x(), 9.1, 0.5);
    EXPECT_NEAR(moved.y(), 4.9, 0.5);
  }
  EXPECT_GT(whole, 50u);
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
