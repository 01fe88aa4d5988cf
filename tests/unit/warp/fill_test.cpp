// SPDX-License-Identifier: GPL-3.0-or-later

#include "finishing/post_process.h"
#include "organbake/bundle/lighting.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

// The bits must tell the frame's skin afterwards, too.
std::size_t slits_filled_in(const PixelBox& box, Frame& frame) {
  const Frame before = frame;
  CoverMask bits, anew;
  bits.read(box, frame);
  KeptPixels kept;
  const std::size_t pixels = fill_slits(bits, frame, kept);
  anew.read(box, frame);
  EXPECT_EQ(bits, anew);
  Frame restored = frame;
  kept.restore(restored);
  EXPECT_EQ(restored.cover, before.cover);
  EXPECT_EQ(restored.color.pixels, before.color.pixels);
  return pixels;
}

Frame grey_frame(int width, int height) {
  Frame frame;
  frame.color = Rgb8Image(width, height);
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{100});
  frame.cover.assign(std::size_t(width) * height, Cover::samples);
  return frame;
}

void open(Frame& frame, int x0, int y0, int x1, int y1) {
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      frame.cover[std::size_t(y) * frame.color.width + x] = Cover::background;
      std::fill_n(frame.color.at(x, y), 3, std::uint8_t{0});
    }
  }
}

constexpr PixelBox kAll{0, 0, 40, 40};

TEST(FillSlits, ClosesPinholesWithTheirNeighbours) {
  Frame frame = grey_frame(40, 40);
  for (const auto& [x, y] : {std::pair{12, 12}, {20, 15}, {21, 15}, {25, 25}})
    open(frame, x, y, x + 1, y + 1);
  EXPECT_EQ(slits_filled_in(kAll, frame), 4u);
  EXPECT_EQ(frame.color.at(20, 15)[1], 100);
  EXPECT_EQ(frame.cover[15 * 40 + 20], Cover::filled);
}

TEST(FillSlits, BridgesANarrowSlitButNotAGapBetweenLobes) {
  for (const bool along_rows : {true, false}) {
    for (int wide = 1; wide <= kWidestSlit + 2; ++wide) {
      Frame frame = grey_frame(40, 40);
      along_rows ? open(frame, 0, 15, 40, 15 + wide) : open(frame, 15, 0, 15 + wide, 40);
      const bool narrow = wide <= kWidestSlit;
      EXPECT_EQ(slits_filled_in(kAll, frame), narrow ? std::size_t(40) * wide : 0u) << wide;
      EXPECT_EQ(frame.covered(15, 15), narrow);
    }
  }
}

TEST(FillSlits, MixesFromEndToEnd) {
  Frame frame = grey_frame(9, 9);
  open(frame, 0, 4, 9, 5);
  std::fill_n(frame.color.at(3, 3), 3, std::uint8_t{50});
  slits_filled_in({0, 0, 9, 9}, frame);
  EXPECT_EQ(frame.color.at(3, 4)[0], 75);
}

// Slits of random pictures, found by whole words, against the same by the pixel.
struct Picture {
  PixelBox box;  // holds all that is covered
  Frame frame;

  bool covered(int x, int y) const {
    return x >= box.x0 && y >= box.y0 && x < box.x1 && y < box.y1 && frame.covered(x, y);
  }
  void fill(int x, int y) { frame.cover[std::size_t(y) * frame.color.width + x] = Cover::filled; }
};

// Up to three words of a row wide, from any column on.
Picture random_picture(RandomStream& random) {
  const auto below = [&](int most) { return static_cast<int>(random.uniform(0, most)); };
  Picture p;
  p.frame.color = Rgb8Image(1 + below(200), 1 + below(40));
  const int width = p.frame.color.width, height = p.frame.color.height;
  p.frame.cover.assign(std::size_t(width) * height, Cover::background);
  p.box = {below(width), below(height), 0, 0};
  p.box.x1 = p.box.x0 + 1 + below(width - p.box.x0);
  p.box.y1 = p.box.y0 + 1 + below(height - p.box.y0);
  const double share = random.uniform(0.3, 0.98);
  for (int y = p.box.y0; y < p.box.y1; ++y) {
    for (int x = p.box.x0; x < p.box.x1; ++x) {
      if (random.uniform(0, 1) >= share) continue;
      p.frame.cover[std::size_t(y) * width + x] =
          random.uniform(0, 1) < 0.5 ? Cover::samples : Cover::base;
    }
  }
  return p;
}

// Of one direction.
std::size_t fill_runs(Picture& p, bool columns) {
  const Picture before = p;
  std::size_t pixels = 0;
  for (int y = p.box.y0; y < p.box.y1; ++y) {
    for (int x = p.box.x0; x < p.box.x1; ++x) {
      const auto at = [&](int i) { return columns ? PixelAt{x, y - i} : PixelAt{x - i, y}; };
      const auto covered = [&](int i) { return before.covered(at(i).x, at(i).y); };
      if (!covered(0)) continue;
      int run = 0;
      while (run <= kWidestSlit && !covered(run + 1)) ++run;
      if (run > kWidestSlit) continue;
      for (int i = 1; i <= run; ++i) p.fill(at(i).x, at(i).y);
      pixels += run;
    }
  }
  return pixels;
}

constexpr int kPictures = 400;

TEST(FillOfRandomPictures, SlitsAreThoseFoundByThePixel) {
  RandomStream random(1);
  for (int i = 0; i < kPictures; ++i) {
    Picture expected = random_picture(random);
    Frame frame = expected.frame;
    const std::size_t of_columns = fill_runs(expected, true);
    ASSERT_EQ(slits_filled_in(expected.box, frame), of_columns + fill_runs(expected, false)) << i;
    ASSERT_EQ(frame.cover, expected.frame.cover) << i;
  }
}

constexpr int kFadeSide = 96, kFade_px = 12;
constexpr std::array<std::uint8_t, 3> kNight = {0, 0, 0};
constexpr PixelBox kWholePicture = {0, 0, kFadeSide, kFadeSide};

Frame skin_where(const Inside& inside) { return white_on_black(kFadeSide, kFadeSide, inside); }

float white_share(const Frame& frame, int x, int y) {
  return linear_from_srgb8()[frame.color.at(x, y)[0]];
}

TEST(BorderFade, ObliqueBordersFadeByTheDistanceAloneOverTheWidth) {
  const double angle = 0.4, c = std::cos(angle), s = std::sin(angle);
  const auto depth = [&](double x, double y) { return c * (x - 48) + s * (y - 48); };
  Frame frame = skin_where([&](double x, double y) { return depth(x, y) > 0; });
  KeptPixels kept;
  fade_borders(kWholePicture, kFade_px, kNight, frame, kept);
  std::vector<double> least(kFadeSide, 1), most(kFadeSide, 0);  // by whole pixels of distance
  // Beyond the picture's edge borders go straight on, away from it.
  for (int y = kFade_px; y < kFadeSide - kFade_px; ++y) {
    for (int x = kFade_px; x < kFadeSide - kFade_px; ++x) {
      const double d = depth(x + 0.5, y + 0.5), light = white_share(frame, x, y);
      if (d <= 0) continue;
      least[int(d)] = std::min(least[int(d)], light), most[int(d)] = std::max(most[int(d)], light);
      if (d > 1.2 * kFade_px) {
        EXPECT_EQ(light, 1) << x << ", " << y;
      }
    }
  }
  EXPECT_LT(most[0], 0.1);
  EXPECT_GT(least[kFade_px - 1], 0.97);
  for (int d = 1; d < kFade_px; ++d) {
    EXPECT_GE(least[d], most[d - 1] - 0.02) << d;  // no staircase: pixels as far in are as bright
    EXPECT_GE(most[d], most[d - 1]);
  }
  EXPECT_NEAR(0.5 * (least[4] + most[4]), 0.6, 0.15);
}

TEST(BorderFade, TeethAreCutAlongALine) {
  constexpr double kTooth = 3;
  Frame frame = skin_where([](double x, double y) {
    return y > 40 + kTooth * (std::fmod(x, 2 * kTooth) < kTooth ? 1 : 0);
  });
  KeptPixels kept;
  fade_borders(kWholePicture, kFade_px, kNight, frame, kept);
  int first = kFadeSide, last = 0;  // rows in which columns are half lit first
  for (int x = kFade_px; x < kFadeSide - kFade_px; ++x) {
    int y = 0;
    while (white_share(frame, x, y) < 0.5f) ++y;
    first = std::min(first, y), last = std::max(last, y);
  }
  EXPECT_LE(last - first, 1);
}

TEST(BorderFade, SkinThatLeavesThePictureStays) {
  Frame frame = skin_where([](double, double) { return true; });
  const Frame before = frame;
  KeptPixels kept;
  fade_borders(kWholePicture, kFade_px, kNight, frame, kept);
  EXPECT_EQ(frame.color.pixels, before.color.pixels);
}

TEST(BorderFade, EndsInTheBackgroundAndIsTakenBack) {
  const auto disc = [](double x, double y) { return std::hypot(x - 40, y - 50) < 30; };
  Frame frame = skin_where(disc);
  const Frame before = frame;
  KeptPixels kept;
  const std::array<std::uint8_t, 3> background = {30, 11, 9};
  fade_borders({10, 20, 70, 80}, SkinFinish::kWidestFade_px, background, frame, kept);
  EXPECT_EQ(frame.cover, before.cover);
  const std::uint8_t* const rim = frame.color.at(10, 50);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(rim[k], background[k]);
  EXPECT_EQ(frame.color.at(40, 50)[0], 255);
  EXPECT_EQ(frame.color.at(5, 50)[0], 0);  // the background is left alone
  kept.restore(frame);
  EXPECT_EQ(frame.color.pixels, before.color.pixels);
  fade_borders(kWholePicture, 1, background, frame, kept);
  EXPECT_EQ(frame.color.pixels, before.color.pixels);
}

TEST(BorderFade, IsAnAngleOfTheViewUpToItsMost) {
  SkinFinish finish;
  EXPECT_EQ(finish.border_fade_px(1000), 0);
  finish.border_fade_rad = 0.01;
  EXPECT_EQ(finish.border_fade_px(1000), 10);
  EXPECT_EQ(finish.border_fade_px(260), 3);
  EXPECT_EQ(finish.border_fade_px(1e9), SkinFinish::kWidestFade_px);
}

}  // namespace
}  // namespace organbake
