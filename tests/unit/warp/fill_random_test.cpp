// SPDX-License-Identifier: Apache-2.0
// Slits and holes of random pictures, found by whole words, against the same by the pixel.
#include <gtest/gtest.h>

#include <algorithm>

#include "finishing/cover_mask.h"
#include "organbake/core/random.h"
#include "unit/warp/filled_frame.h"

namespace organbake {
namespace {

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

std::size_t fill_round(Picture& p) {
  const Picture before = p;
  std::size_t pixels = 0;
  for (int y = p.box.y0; y < p.box.y1; ++y) {
    for (int x = p.box.x0; x < p.box.x1; ++x) {
      int round = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) round += before.covered(x + dx, y + dy);
      }
      if (before.covered(x, y) || round < 5) continue;
      p.fill(x, y);
      ++pixels;
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
    ASSERT_EQ(slits_filled_in(expected.box, true, frame), of_columns + fill_runs(expected, false))
        << i;
    ASSERT_EQ(frame.cover, expected.frame.cover) << i;
  }
}

TEST(FillOfRandomPictures, HolesAreThoseFoundByThePixel) {
  RandomStream random(2);
  for (int i = 0; i < kPictures; ++i) {
    Picture expected = random_picture(random);
    Frame frame = expected.frame;
    const HoleCounts counts = holes_filled_in(expected.box, true, frame);
    ASSERT_EQ(counts.before, fill_round(expected)) << i;
    for (int round = 1; round < kFillRounds; ++round) fill_round(expected);
    ASSERT_EQ(frame.cover, expected.frame.cover) << i;
    ASSERT_EQ(counts.after, fill_round(expected)) << i;
  }
}

TEST(FillOfRandomPictures, CoversAreCounted) {
  RandomStream random(3);
  for (int i = 0; i < kPictures; ++i) {
    const Picture p = random_picture(random);
    for (const Cover cover : {Cover::samples, Cover::base, Cover::solid}) {
      const auto expected = std::count(p.frame.cover.begin(), p.frame.cover.end(), cover);
      ASSERT_EQ(count_cover(p.frame, p.box, cover), static_cast<std::size_t>(expected)) << i;
    }
  }
}

// Only the bit carried from one word to the next tells of these.
TEST(FillOfRandomPictures, AHoleAtAWordsBorderIsFound) {
  for (const int x : {63, 64}) {
    Frame frame;
    frame.color = Rgb8Image(128, 3);
    frame.cover.assign(std::size_t{128} * 3, Cover::background);
    const auto cover = [&](int px, int py) { frame.cover[py * 128 + px] = Cover::samples; };
    cover(x == 63 ? 64 : 63, 1);
    for (const int dx : {-1, 1}) cover(x + dx, 0), cover(x + dx, 2);
    holes_filled_in({0, 0, 128, 3}, true, frame);
    EXPECT_EQ(frame.cover[128 + x], Cover::filled) << x;
  }
}

}  // namespace
}  // namespace organbake
