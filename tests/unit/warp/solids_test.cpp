// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/solids.h"

#include <gtest/gtest.h>

#include <limits>

#include "organbake/core/random.h"

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

std::size_t draw(const std::vector<Solid>& solids, const View& view, Frame& frame) {
  return draw_solids(solids, solid_blocks(solids, view), view, frame);
}

TEST(DrawSolids, BlocksHoldAllThatCanBeSeen) {
  RandomStream random(11);
  const auto place = [&] {
    return Eigen::Vector3d(random.uniform(-150, 150), random.uniform(-150, 150),
                           random.uniform(-60, 400));
  };
  View view = straight_view();
  view.near_mm = 5;
  for (int scene = 0; scene < 60; ++scene) {
    std::vector<Solid> solids(1 + random.below(4));
    for (Solid& solid : solids) {
      solid.from = solid.to = place();
      if (random.uniform(0, 1) < 0.8) solid.to = place();
      solid.radius_mm = random.uniform(0.2, 40);
    }
    SolidBlock all{{0, 0, kWidth, kHeight}, {}};
    for (std::uint32_t s = 0; s < solids.size(); ++s) all.solids.push_back(s);
    Frame blocks = empty_frame(), whole = empty_frame();
    EXPECT_EQ(draw(solids, view, blocks), draw_solids(solids, {all}, view, whole));
    EXPECT_EQ(blocks.color.pixels, whole.color.pixels) << "scene " << scene;
    EXPECT_EQ(blocks.depth_mm, whole.depth_mm) << "scene " << scene;
  }
}

TEST(DrawSolids, BlocksFollowAThinShaftAcrossThePicture) {
  Solid shaft = shaft_to({100, 60, 200});
  shaft.from = {-100, -60, 200};
  std::size_t pixels = 0;
  for (const SolidBlock& block : solid_blocks({shaft}, straight_view()))
    pixels += std::size_t(block.box.width()) * block.box.height();
  Frame frame = empty_frame();
  const std::size_t touched = draw({shaft}, straight_view(), frame);
  EXPECT_LT(pixels, 8 * touched);
}

TEST(DrawSolids, AShaftThatLeadsOutOfThePictureReachesItsRim) {
  // Its far end lies beside the picture: below, to the left, and behind the eye.
  for (const Eigen::Vector3d& end :
       {Eigen::Vector3d(0, 150, 150), Eigen::Vector3d(-300, 0, 200), Eigen::Vector3d(0, 60, -30)}) {
    Frame frame = empty_frame();
    draw({shaft_to(end)}, straight_view(), frame);
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
  EXPECT_EQ(draw({solid}, straight_view(), frame), 0u);
}

TEST(DrawSolids, TissueInFrontHidesThem) {
  Frame frame = empty_frame();
  for (float& depth : frame.depth_mm) depth = 100;
  EXPECT_EQ(draw({shaft_to({20, 0, 200})}, straight_view(), frame), 0u);
}

}  // namespace
}  // namespace organbake
