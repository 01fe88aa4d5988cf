// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/feature_tracker.h"

#include "organbake/core/error.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/clip_spans.h"
#include "support/testing.h"
#include "unit/motion/motion_scenes.h"

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

// Tissue seen through a round stop, or through a window that is not round; black beside it.
Rgb8Image seen_through(const Eigen::Vector2d& center, double radius_px, bool round) {
  Rgb8Image picture(320, 240);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const Eigen::Array2d off = (Eigen::Vector2d(x + 0.5, y + 0.5) - center).array().abs();
      if ((round ? off.matrix().norm() : off.maxCoeff()) > radius_px) continue;
      picture.at(x, y)[0] = 160, picture.at(x, y)[1] = 70, picture.at(x, y)[2] = 60;
    }
  return picture;
}

TEST(UsablePixels, TellTheMiddleOfARoundStop) {
  const Eigen::Vector2d middle(171.5, 112);
  const auto told = [](const Rgb8Image& picture) {
    UsablePixels usable;
    usable.next(picture);
    return usable.stop_center();
  };
  // Whole, and cut off above and below by the picture's edge.
  for (const double radius_px : {95.0, 140.0}) {
    const auto center = told(seen_through(middle, radius_px, true));
    ASSERT_TRUE(center) << radius_px;
    EXPECT_LT((*center - middle).norm(), 1) << radius_px;
  }
  // A recorder cut the circle off above and below, and left some dark lines there.
  Rgb8Image cut = seen_through(middle, 140, true);
  for (const int first : {0, 234}) std::fill_n(cut.at(0, first), 6 * 3 * cut.width, 0);
  const auto center = told(cut);
  ASSERT_TRUE(center);
  EXPECT_LT((*center - middle).norm(), 1);
  EXPECT_FALSE(told(seen_through(middle, 90, false))) << "a square";
  EXPECT_FALSE(told(seen_through(middle, 400, true))) << "no border in sight";
  EXPECT_FALSE(told(seen_through({-60, 120}, 300, true))) << "an arc on one side tells little";
}

std::size_t followed_in(const ClipTracks& clip, std::size_t frame) {
  return static_cast<std::size_t>(
      std::count_if(clip.tracks.begin(), clip.tracks.end(),
                    [&](const FeatureTrack& track) { return track.is_in(frame); }));
}

TEST(FeatureTracker, LooksForMoreFeaturesWhereFewSurvive) {
  // Three quarters of the picture are noise, of which hardly a feature survives a frame.
  constexpr int kFeatures = 100, kFrames = 16;
  FeatureTracker noisy({.features = kFeatures}), clear({.features = kFeatures});
  const Mask all(320, 240, 1);
  for (int frame = 0; frame < kFrames; ++frame) {
    const Grid<std::uint8_t> picture = blotches(1.3 * frame, 0.7 * frame);
    clear.add(picture, all);
    Grid<std::uint8_t> hidden = picture;
    RandomStream random(5, static_cast<std::uint64_t>(frame));
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 240; ++x)
        hidden.at(x, y) = static_cast<std::uint8_t>(255 * random.uniform());
    noisy.add(hidden, all);
  }
  const ClipTracks few = noisy.take(), many = clear.take();
  EXPECT_GT(followed_in(few, 15), kFeatures * 13u / 10) << "just after a refill";
  EXPECT_LE(followed_in(many, 15), 1u * kFeatures) << "no more than are needed";
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

struct ViewChoices : testing::Test {
  const ClipTracks clip = tracks_of(swinging_scope(60)).clip;
  std::vector<double> sharpness = std::vector<double>(clip.frames, 1);
  std::vector<std::size_t> chosen(const ViewChoice& choice) const {
    return choose_views(choice, clip, sharpness, 0, clip.frames);
  }
};

TEST_F(ViewChoices, TakeMoreViewsWhereTheScopeMovesFaster) {
  const auto coarse = chosen({.motion_share = 0.05}), fine = chosen({.motion_share = 0.01});
  EXPECT_LT(coarse.size(), fine.size());
  EXPECT_EQ(coarse.front(), 0u);
  EXPECT_LE(chosen({.motion_share = 0.001, .most_views = 20}).size(), 20u);
}

TEST_F(ViewChoices, PassOverBlurredFrames) {
  for (std::size_t frame = 1; frame < sharpness.size(); frame += 2) sharpness[frame] = 0.1;
  const auto views = chosen({.motion_share = 0.05});
  for (std::size_t i = 1; i + 1 < views.size(); ++i) EXPECT_EQ(views[i] % 2, 0u);
}

TEST_F(ViewChoices, AreTheSameWhileTheClipIsRead) {
  const ViewChoice choice{.motion_share = 0.02};
  std::vector<std::size_t> views = {0};
  for (std::size_t end = 1; end <= clip.frames; ++end)
    while (const auto view =
               next_view(choice, clip, sharpness, views.back(), end, end == clip.frames))
      views.push_back(*view);
  EXPECT_EQ(views, chosen(choice));
}

constexpr int kWidth = 320, kStep = 8, kPerSecond = 3;

Rgb8Image red_picture(const BumpyView& view) {
  Rgb8Image picture(view.light.width, view.light.height);
  RandomStream random(11, static_cast<std::uint64_t>(std::stoi(view.camera.name)));
  for (std::size_t k = 0; k < view.light.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      const double of_light[] = {150, 75, 65};
      const double level = of_light[c] * double(view.light.values[k]) + 0.5 * random.normal();
      picture.pixels[3 * k + c] = static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0));
    }
  return picture;
}

TEST(ClipSpans, TellsAMovingScopeFromAStillOneAndFromNoTissue) {
  SpanFinder finder({.shortest_s = 2, .longest_s = 12});
  const std::vector<BumpyView> moving = bumpy_clip({}, 12, kWidth);
  const Rgb8Image still = red_picture(moving.back());
  std::size_t shown = 0;
  const auto show = [&](const Rgb8Image& picture) {
    finder.add(kStep * shown, double(shown) / kPerSecond, picture);
    ++shown;
  };
  for (const BumpyView& view : moving) show(red_picture(view));
  for (int i = 0; i < 12; ++i) show(Rgb8Image(kWidth, kWidth * 3 / 4));
  for (int i = 0; i < 12; ++i) show(still);
  const std::vector<ClipSpan> spans = finder.take();
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_GT(spans[0].worth, SpanFinder::kShadingAlone) << spans[0].reason;
  EXPECT_EQ(spans[0].first, 0u);
  EXPECT_EQ(spans[0].last, kStep * 11u);
  EXPECT_EQ(spans[1].worth, 0) << spans[1].reason;
  EXPECT_EQ(spans[2].reason, "the scope stands still");
  EXPECT_GT(spans[2].worth, 0);
  EXPECT_LE(spans[2].worth, SpanFinder::kShadingAlone);
}

TEST(ClipSpans, CutsWhatIsLong) {
  SpanFinder finder({.shortest_s = 1, .longest_s = 2});
  std::size_t shown = 0;
  for (const BumpyView& view : bumpy_clip({}, 12, kWidth)) {
    finder.add(shown, double(shown) / kPerSecond, red_picture(view));
    ++shown;
  }
  const std::vector<ClipSpan> spans = finder.take();
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0].last + 1, spans[1].first);
  EXPECT_EQ(spans[1].last, 11u);
}

TEST(ClipSpans, HasNoneOfNothing) { EXPECT_TRUE(SpanFinder().take().empty()); }

}  // namespace
}  // namespace organbake
