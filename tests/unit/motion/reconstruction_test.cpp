// SPDX-License-Identifier: GPL-3.0-or-later
#include "two_views.h"

#include <gtest/gtest.h>

#include "organbake/motion/scene.h"
#include "unit/motion/motion_scenes.h"

namespace organbake {
namespace {

TwoViews relate(const std::vector<PosedCamera>& cameras) {
  const TrackedScene tracked = tracks_of(cameras, 0.3, 0.1);
  std::vector<Eigen::Vector2d> first, second;
  for (const FeatureTrack& track : tracked.clip.tracks)
    if (track.is_in(0) && track.is_in(1)) {
      first.push_back(track.at(0).cast<double>());
      second.push_back(track.at(1).cast<double>());
    }
  return relate_views(cameras[0].intrinsics, first, second);
}

TEST(TwoViews, FindHowTheScopeMoved) {
  std::vector<PosedCamera> cameras = swinging_scope(9);
  const TwoViews views = relate({cameras[0], cameras[3]});
  const RigidTransform truth =
      cameras[3].camera_from_world * cameras[0].camera_from_world.inverse();
  EXPECT_LT((views.second_from_first.rotation - truth.rotation).norm(), 0.01);
  EXPECT_GT(views.second_from_first.translation.dot(truth.translation.normalized()), 0.995);
  EXPECT_GT(views.agreeing, 500u);
  EXPECT_GT(views.parallax_px, 2);
}

TEST(TwoViews, SeeNoParallaxInATurn) {
  std::vector<PosedCamera> cameras(2, {"", hd_lens(), {}});
  cameras[1].camera_from_world.rotation =
      Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_LT(relate(cameras).parallax_px, 2);
}

TEST(TwoViews, TellNothingOfAFewPairs) {
  const std::vector<Eigen::Vector2d> few(10, Eigen::Vector2d(1, 2));
  EXPECT_EQ(relate_views(hd_lens(), few, few).agreeing, 0u);
}

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
