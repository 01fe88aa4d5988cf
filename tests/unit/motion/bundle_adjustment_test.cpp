// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/bundle_adjustment.h"

#include <gtest/gtest.h>

#include "organbake/motion/triangulation.h"
#include "unit/motion/tracked_scene.h"

namespace organbake {
namespace {

// The scene as it is, its landmarks placed from their tracks.
Scene true_scene(const TrackedScene& tracked) {
  Scene scene = posed_scene(tracked);
  triangulate({}, scene);
  return scene;
}

TEST(BundleAdjustment, BringsShakenPosesBack) {
  const TrackedScene tracked = tracks_of(swinging_scope(10), 0.0, 0);
  Scene scene = true_scene(tracked);
  for (std::size_t view = 2; view < scene.camera_from_world.size(); ++view)
    scene.camera_from_world[view]->translation += Eigen::Vector3d(0.3, -0.2, 0.1);
  const AdjustmentSummary summary = adjust({.iterations = 50, .tolerance = 1e-10}, scene);
  EXPECT_LT(summary.rms_px, 0.01) << "exact tracks leave nothing";
  EXPECT_LT(path_error(tracked.cameras, scene.camera_from_world), 1e-3);
}

TEST(BundleAdjustment, LeavesAGivenLensAlone) {
  Scene scene = true_scene(tracks_of(swinging_scope(6), 0.3, 0));
  adjust({}, scene);
  EXPECT_EQ(scene.lens.fx, hd_lens().fx);
  EXPECT_EQ(scene.lens.cx, hd_lens().cx);
}

TEST(BundleAdjustment, PosesOneViewAlone) {
  const TrackedScene tracked = tracks_of(swinging_scope(6), 0.0, 0);
  const Scene scene = true_scene(tracked);
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector2d> pixels;
  for (const Landmark& landmark : scene.landmarks)
    if (const Sighting* sighting = sighting_in(landmark, 3); sighting && landmark.place) {
      places.push_back(*landmark.place);
      pixels.push_back(sighting->pixel);
    }
  // One that lies behind the camera hinders none of the others.
  places.push_back(-2 * places.front());
  pixels.push_back(pixels.front());
  RigidTransform pose = *scene.camera_from_world[2];
  ASSERT_LT((pose * places.back()).z(), 0);
  EXPECT_GT(adjust_pose(scene.lens, places, pixels, 1, pose), places.size() * 9 / 10);
  EXPECT_LT((pose.translation - scene.camera_from_world[3]->translation).norm(), 1e-2);
}

}  // namespace
}  // namespace organbake
