// SPDX-License-Identifier: GPL-3.0-or-later
#include "borrow_depth.h"

#include <gtest/gtest.h>

#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

TEST(BorrowDepth, TakesFromPartnersWhatAFrameDoesNotKnow) {
  const std::vector<BumpyView> views = bumpy_clip(BumpyScene{}, 3);
  const int width = views[0].depth_mm.width, height = views[0].depth_mm.height;
  std::vector<PosedCamera> cameras;
  std::vector<SweptDepth> swept;
  for (const BumpyView& view : views) {
    cameras.push_back(view.camera);
    swept.push_back({view.depth_mm, Plane(width, height, 0.004F), Plane(width, height, 0.9F)});
  }
  // The middle frame knows nothing of its middle; the last one doubts its own, which is wrong.
  Mask hole(width, height);
  for (int y = 40; y < 80; ++y)
    for (int x = 60; x < 100; ++x) {
      hole.at(x, y) = 1;
      swept[1].depth.at(x, y) = std::numeric_limits<float>::infinity();
      swept[1].confidence.at(x, y) = 0;
    }
  for (float& depth : swept[2].depth.values) depth *= 1.3F;
  swept[2].confidence = Plane(width, height, 0.3F);
  borrow_depth(cameras, {{1, 2}, {0, 2}, {0, 1}}, swept);
  EXPECT_LT(median_error(swept[1].depth, views[1].depth_mm, hole), 0.01);
  int filled = 0, wanted = 0;
  for (std::size_t k = 0; k < hole.size(); ++k) {
    if (!hole.values[k]) continue;
    ++wanted;
    filled += swept[1].confidence.values[k] > 0;
    EXPECT_LT(swept[1].confidence.values[k], 0.9F) << "lent depth is less sure than its lender's";
  }
  EXPECT_GT(filled, 0.7 * wanted);
  EXPECT_EQ(swept[0].depth, views[0].depth_mm) << "who is sure borrows nothing";
  EXPECT_LT(median_error(swept[2].depth, views[2].depth_mm), 0.01);
}

}  // namespace
}  // namespace organbake
