// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/triangulation.h"

#include <gtest/gtest.h>

#include "unit/motion/tracked_scene.h"

namespace organbake {
namespace {

TEST(Triangulation, PutsLandmarksOnTheTissue) {
  Scene scene = posed_scene(tracks_of(swinging_scope(10), 0.0, 0));
  triangulate({}, scene);
  std::size_t placed = 0;
  for (const Landmark& landmark : scene.landmarks) {
    if (!landmark.place) continue;
    ++placed;
    const double height = BumpyScene().height_mm(landmark.place->x(), landmark.place->y());
    EXPECT_NEAR(landmark.place->z(), height, 0.01) << "tracks are floats";
  }
  EXPECT_GT(placed, scene.landmarks.size() * 9 / 10);
}

TEST(Triangulation, LeavesWhatIsSeenUnderTooSmallAnAngle) {
  std::vector<PosedCamera> near(2, swinging_scope(2)[0]);
  near[1].camera_from_world.translation.x() += 0.2;  // 0.2 degrees at 60 mm
  Scene scene = posed_scene(tracks_of(std::move(near), 0.0, 0));
  triangulate({}, scene);
  for (const Landmark& landmark : scene.landmarks) EXPECT_FALSE(landmark.place);
}

TEST(Triangulation, DropsSightingsThatDoNotAgree) {
  Scene scene = posed_scene(tracks_of(swinging_scope(10), 0.0, 0));
  triangulate({}, scene);
  Landmark& landmark =
      *std::find_if(scene.landmarks.begin(), scene.landmarks.end(),
                    [](const Landmark& one) { return one.place && one.seen.size() == 10; });
  landmark.seen[4].pixel.x() += 20;
  drop_outliers({}, scene);
  ASSERT_TRUE(landmark.place);
  EXPECT_FALSE(landmark.seen[4].agrees);
  EXPECT_TRUE(landmark.seen[5].agrees);
}

}  // namespace
}  // namespace organbake
