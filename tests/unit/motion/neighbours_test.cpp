// SPDX-License-Identifier: GPL-3.0-or-later
#include "neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

PosedCamera camera_at(double x_mm, double y_mm = 0) {
  Intrinsics lens;
  lens.width = 160, lens.height = 120;
  lens.fx = lens.fy = 150, lens.cx = 80, lens.cy = 60;
  return {.name = {},
          .intrinsics = lens,
          .camera_from_world = look_at({x_mm, y_mm, 0}, {x_mm, y_mm, 60}, {0, -1, 0})};
}

bool holds(const std::vector<std::size_t>& list, std::size_t index) {
  return std::find(list.begin(), list.end(), index) != list.end();
}

TEST(Neighbours, TakesTheBestAnglesFirst) {
  // 4.8 mm at 60 mm are the best 0.08 rad.
  const std::vector<PosedCamera> cameras = {camera_at(0), camera_at(0.1), camera_at(1),
                                            camera_at(4.8), camera_at(15)};
  const std::vector<std::size_t> found = best_neighbours(cameras, 0, 60);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front(), 3u);
  EXPECT_FALSE(holds(found, 0)) << "a frame is no neighbour of itself";
  EXPECT_FALSE(holds(found, 1)) << "0.1 mm tell nothing of depth";
}

TEST(Neighbours, LeavesOutWhoLooksElsewhere) {
  std::vector<PosedCamera> cameras = {camera_at(0), camera_at(5), camera_at(5)};
  cameras[2].camera_from_world = look_at({5, 0, 0}, {65, 0, 10}, {0, -1, 0});
  EXPECT_EQ(best_neighbours(cameras, 0, 60), std::vector<std::size_t>{1});
}

TEST(Neighbours, LooksFromSeveralSides) {
  std::vector<PosedCamera> cameras = {camera_at(0)};
  for (int i = 0; i < 6; ++i) cameras.push_back(camera_at(4.8 + 0.05 * i));
  cameras.push_back(camera_at(-3.5));
  cameras.push_back(camera_at(0, 3.5));
  const std::vector<std::size_t> found = best_neighbours(cameras, 0, 60, {.most = 3});
  ASSERT_EQ(found.size(), 3u);
  EXPECT_TRUE(holds(found, 7) && holds(found, 8));
}

TEST(Neighbours, PrefersThoseNearInTime) {
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < 40; ++i) cameras.push_back(camera_at(i % 2 ? 4.8 : 0));
  const std::vector<std::size_t> found =
      best_neighbours(cameras, 20, 60, {.most = 2, .usual_gap = 4});
  EXPECT_EQ(found.size(), 2u);
  for (const std::size_t i : found) EXPECT_LE(i > 20 ? i - 20 : 20 - i, 3u);
}

}  // namespace
}  // namespace organbake
