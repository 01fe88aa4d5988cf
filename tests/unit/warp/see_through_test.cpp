// SPDX-License-Identifier: Apache-2.0
#include "warp/see_through.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "core/random.h"

namespace organbake {
namespace {

constexpr int kPictureWidth = 600, kPictureHeight = 80;
constexpr float kDeeperMm = 4;

struct Picture {
  Frame frame;
  std::vector<float> depth_mm =
      std::vector<float>(std::size_t(kPictureWidth) * kPictureHeight, 100);

  Picture() {
    frame.color = Rgb8Image(kPictureWidth, kPictureHeight);
    frame.cover.assign(depth_mm.size(), Cover::samples);
  }
  void set_depth(int x0, int y0, int x1, int y1, float depth) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) depth_mm[std::size_t(y) * kPictureWidth + x] = depth;
    }
  }
  std::size_t open() {
    const auto found =
        find_see_through({0, 0, kPictureWidth, kPictureHeight}, depth_mm, kDeeperMm, frame);
    for (const std::uint32_t pixel : found) frame.cover[pixel] = Cover::background;
    return found.size();
  }
};

TEST(SeeThrough, OpensSlitsAlongRowsAndColumns) {
  Picture picture;
  picture.set_depth(20, 10, 400, 12, 150);  // two pixels high, across blocks
  picture.set_depth(500, 20, 501, 70, 150);
  picture.set_depth(300, 40, 301, 41, 150);
  EXPECT_EQ(picture.open(), 380u * 2 + 50 + 1);
  EXPECT_FALSE(picture.frame.covered(20, 11));
  EXPECT_FALSE(picture.frame.covered(500, 69));
  EXPECT_TRUE(picture.frame.covered(499, 69));
}

TEST(SeeThrough, LeavesStepsSlopesAndWideGapsAlone) {
  Picture picture;
  picture.set_depth(0, 0, 100, kPictureHeight, 150);  // a step: an outline before something farther
  picture.set_depth(200, 20, 206, 60, 150);           // a gap between two lobes
  for (int x = 300; x < 400; ++x)
    picture.set_depth(x, 0, x + 1, kPictureHeight, 100 + 1.5f * (x - 300));
  EXPECT_EQ(picture.open(), 0u);
}

TEST(SeeThrough, TheBackgroundIsNoSide) {
  Picture picture;
  picture.set_depth(50, 0, 52, kPictureHeight, 150);
  for (int y = 0; y < kPictureHeight; ++y) {
    for (int x = 0; x < 50; ++x) {
      picture.frame.cover[std::size_t(y) * kPictureWidth + x] = Cover::background;
      picture.depth_mm[std::size_t(y) * kPictureWidth + x] = 1;  // stale
    }
  }
  EXPECT_EQ(picture.open(), 0u);
}

TEST(SeeThrough, IsTheSameForAnyNumberOfThreads) {
  RandomStream random(7);
  Picture one;
  for (float& depth : one.depth_mm) depth = random.uniform(0, 1) < 0.1 ? 150.0f : 100.0f;
  Picture two = one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_GT(one.open(), 0u);
  }
  two.open();
  EXPECT_EQ(one.frame.cover, two.frame.cover);
}

}  // namespace
}  // namespace organbake
