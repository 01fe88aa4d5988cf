// SPDX-License-Identifier: Apache-2.0
#include "warp/solids.h"

#include <gtest/gtest.h>

#include <limits>

namespace organbake {
namespace {

constexpr int kWidth = 320, kHeight = 200;

Frame empty_frame() {
  Frame frame;
  frame.color = Rgb8Image(kWidth, kHeight);
  frame.cover.assign(kWidth * kHeight, Cover::background);
  frame.depth_mm.assign(kWidth * kHeight, std::numeric_limits<float>::infinity());
  return frame;
}

View straight_view() {
  View view;
  view.camera.intrinsics = {kWidth, kHeight, 250, 250, kWidth / 2.0, kHeight / 2.0};
  return view;
}

Solid shaft_to(const Eigen::Vector3d& end) {
  Solid solid;
  solid.from = Eigen::Vector3d(0, 0, 200);
  solid.to = end;
  solid.radius_mm = 2;
  return solid;
}

TEST(DrawSolids, AShaftThatLeadsOutOfThePictureReachesItsRim) {
  // Its far end lies beside the picture: below, to the left, and behind the eye.
  for (const Eigen::Vector3d& end :
       {Eigen::Vector3d(0, 150, 150), Eigen::Vector3d(-300, 0, 200), Eigen::Vector3d(0, 60, -30)}) {
    Frame frame = empty_frame();
    draw_solids({shaft_to(end)}, straight_view(), frame);
    bool at_rim = false;
    for (int y = 0; y < kHeight; ++y)
      at_rim |= frame.cover[std::size_t(y) * kWidth] == Cover::solid;
    for (int x = 0; x < kWidth; ++x) {
      at_rim |= frame.cover[std::size_t(kHeight - 1) * kWidth + x] == Cover::solid;
    }
    EXPECT_TRUE(at_rim) << end.transpose();
  }
}

TEST(DrawSolids, WhatLiesBesideThePictureCostsNothing) {
  Frame frame = empty_frame();
  Solid solid = shaft_to({400, 0, 200});
  solid.from.x() = 300;
  EXPECT_EQ(draw_solids({solid}, straight_view(), frame), 0u);
}

TEST(DrawSolids, TissueInFrontHidesThem) {
  Frame frame = empty_frame();
  for (float& depth : frame.depth_mm) depth = 100;
  EXPECT_EQ(draw_solids({shaft_to({20, 0, 200})}, straight_view(), frame), 0u);
}

}  // namespace
}  // namespace organbake
