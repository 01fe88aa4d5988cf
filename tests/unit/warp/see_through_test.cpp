// SPDX-License-Identifier: Apache-2.0
#include "finishing/see_through.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/warp/frame.h"

namespace organbake {
namespace {

constexpr int kPictureWidth = 600, kPictureHeight = 80;
constexpr float kDeeperMm = 4;

struct TerracePicture {
  Frame frame;
  SkinDepth depth;

  TerracePicture() {
    depth.resize(kPictureWidth, kPictureHeight, 400);
    set_depth(0, 0, kPictureWidth, kPictureHeight, 100);
    frame.color = Rgb8Image(kPictureWidth, kPictureHeight);
    frame.cover.assign(std::size_t(kPictureWidth) * kPictureHeight, Cover::samples);
  }
  void set_depth(int x0, int y0, int x1, int y1, float mm) {
    const std::vector<float> row(whole_vectors(x1 - x0), mm);
    for (int y = y0; y < y1; ++y) depth.put(x0, y, x1 - x0, row.data());
  }
  std::size_t open(const PixelBox& box = {0, 0, kPictureWidth, kPictureHeight}) {
    const auto found = find_see_through(box, depth, kDeeperMm);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    for (const std::uint32_t pixel : found) frame.cover[pixel] = Cover::background;
    return found.size();
  }
};

TEST(SeeThrough, OpensSlitsAlongRowsAndColumns) {
  TerracePicture picture;
  picture.set_depth(20, 10, 400, 12, 150);  // two pixels high, across blocks
  picture.set_depth(500, 20, 501, 70, 150);
  picture.set_depth(300, 40, 301, 41, 150);
  EXPECT_EQ(picture.open(), 380u * 2 + 50 + 1);
  EXPECT_FALSE(picture.frame.covered(20, 11));
  EXPECT_FALSE(picture.frame.covered(500, 69));
  EXPECT_TRUE(picture.frame.covered(499, 69));
}

TEST(SeeThrough, LeavesStepsSlopesAndWideGapsAlone) {
  TerracePicture picture;
  picture.set_depth(0, 0, 100, kPictureHeight, 150);  // a step: an outline before something farther
  picture.set_depth(200, 20, 206, 60, 150);           // a gap between two lobes
  for (int x = 300; x < 400; ++x)
    picture.set_depth(x, 0, x + 1, kPictureHeight, 100 + 1.5f * (x - 300));
  EXPECT_EQ(picture.open(), 0u);
}

TEST(SeeThrough, TheBackgroundIsNoSide) {
  TerracePicture picture;
  picture.set_depth(50, 0, 52, kPictureHeight, 150);
  picture.depth.clear({0, 0, 50, kPictureHeight});
  // The picture's border is none, either.
  picture.set_depth(kPictureWidth - 1, 0, kPictureWidth, kPictureHeight, 150);
  picture.set_depth(0, 0, kPictureWidth, 1, 150);
  EXPECT_EQ(picture.open(), 0u);
}

TEST(SeeThrough, SkinBeyondTheReachIsOneDepth) {
  TerracePicture picture;
  picture.set_depth(0, 0, kPictureWidth, kPictureHeight, 500);
  picture.set_depth(50, 0, 52, kPictureHeight, 1e30f);
  EXPECT_EQ(picture.open(), 0u);
  picture.set_depth(0, 0, kPictureWidth, kPictureHeight, 390);
  picture.set_depth(50, 0, 52, kPictureHeight, 1e30f);
  EXPECT_EQ(picture.open(), 2u * kPictureHeight);
}

TEST(SeeThrough, LooksBeyondTheBoxButFindsNothingThere) {
  TerracePicture picture;
  picture.set_depth(100, 0, 102, kPictureHeight, 150);
  EXPECT_EQ(picture.open({101, 10, 300, 20}), 10u);
  EXPECT_EQ(picture.open({60, 10, 101, 20}), 10u);
  EXPECT_EQ(picture.open({102, 10, 300, 20}), 0u);
}

TEST(SeeThrough, IsTheSameForAnyNumberOfThreads) {
  RandomStream random(7);
  TerracePicture one;
  for (int y = 0; y < kPictureHeight; ++y) {
    for (int x = 0; x < kPictureWidth; ++x)
      one.set_depth(x, y, x + 1, y + 1, random.uniform(0, 1) < 0.1 ? 150.0f : 100.0f);
  }
  TerracePicture two = one;
  {
    const ThreadLimit limit(1);
    EXPECT_GT(one.open(), 0u);
  }
  two.open();
  EXPECT_EQ(one.frame.cover, two.frame.cover);
}

}  // namespace
}  // namespace organbake
