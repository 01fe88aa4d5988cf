// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/rectifier.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "organbake/geometry/camera.h"
#include "organbake/phantom/laparoscopy.h"
#include "stereo_scene.h"

namespace organbake {
namespace {

// Eyes that look inward and are turned against each other.
StereoRig askew_rig() {
  Intrinsics lens{.width = 480, .height = 384, .fx = 347, .fy = 348, .cx = 233, .cy = 193};
  StereoRig rig{lens, lens, {}};
  rig.right.cx = 248;
  rig.right.fx = 350;
  rig.left.k1 = -0.05;
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()))
                                   .toRotationMatrix();
  rig.right_from_left = {turn, {-4.5, 0.1, 0.05}};
  return rig;
}

TEST(Rectifier, PicturesThatStandSideBySideStayAsTheyAre) {
  const LaparoscopyPhantom phantom(stereo_scene(96, 72));
  const Rectifier rectifier(rig_of(phantom));
  EXPECT_FALSE(rectifier.changes_pictures());
  EXPECT_NEAR(rectifier.eyes().baseline_mm, 4.5, 1e-9);
  EXPECT_EQ(rectifier.eyes().disparity_at_infinity, 0);
}

TEST(Rectifier, PointsLieOnOneRowAndTheirDisparityIsTheirDepth) {
  const StereoRig rig = askew_rig();
  const Rectifier rectifier(rig);
  ASSERT_TRUE(rectifier.changes_pictures());
  const RectifiedEyes& eyes = rectifier.eyes();
  const Eigen::Matrix3d turn = eyes.rectified_from_left.rotation;
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0, 0, 60), Eigen::Vector3d(20, -15, 45), Eigen::Vector3d(-25, 18, 95)}) {
    const Eigen::Vector3d turned = turn * point;
    const Eigen::Vector2d a = project(eyes.camera, turned);
    const Eigen::Vector2d b = project(eyes.right(), turned);
    EXPECT_NEAR(a.y(), b.y(), 1e-9);
    const double disparity = a.x() - b.x() - eyes.disparity_at_infinity;
    EXPECT_NEAR(eyes.camera.fx * eyes.baseline_mm / disparity, turned.z(), 1e-6);
    // The same place of the right eye's camera as it was calibrated.
    const Eigen::Vector3d by_rig = rig.right_from_left * point;
    const Eigen::Vector3d by_eyes = eyes.right().camera_from_world * turned;
    EXPECT_NEAR(by_rig.norm(), by_eyes.norm(), 1e-6);
  }
}

// A rendered pair of turned cameras comes out as exact as one that stands straight.
void expect_the_scene(const StereoRig& rig) {
  LaparoscopyOptions scene = stereo_scene(480, 384);
  scene.round_view = false;
  const LaparoscopyPhantom phantom(scene);
  PosedCamera left = phantom.camera(0), right = left;
  left.intrinsics = rig.left;
  right.intrinsics = rig.right;
  right.camera_from_world = rig.right_from_left * left.camera_from_world;
  const Eigen::Vector3d light = left.center_world_mm();
  const LaparoscopyFrame a = phantom.frame_seen_by(left, light, 1),
                         b = phantom.frame_seen_by(right, light, 2);
  const Rectifier rectifier(rig);
  PreparedFrame prepared;
  const StereoDepth found = depth_of_pair(rectifier, a.image, b.image, &prepared);
  // The truth as the rectified camera sees it.
  PosedCamera turned{"turned", rectifier.eyes().camera,
                     rectifier.eyes().rectified_from_left * left.camera_from_world};
  const LaparoscopyFrame truth = phantom.frame_seen_by(turned, light, 3);
  const DepthErrors errors = errors_of(found.depth.depth, truth.depth_mm, prepared.tissue);
  EXPECT_LT(errors.mean, 0.01);
  EXPECT_LT(errors.bad, 0.03);
  EXPECT_GT(errors.dense, 0.8);
  EXPECT_LT(std::abs(found.rows_apart_px), 0.1);
}

TEST(Rectifier, TurnedEyesMeasureTheSameScene) {
  StereoRig rig = askew_rig();
  rig.left = pinhole_of(rig.left);
  expect_the_scene(rig);
}

TEST(Rectifier, FisheyesMeasureTheSameScene) {
  StereoRig rig = askew_rig();
  for (Intrinsics* lens : {&rig.left, &rig.right}) {
    *lens = pinhole_of(*lens);
    lens->model = LensModel::fisheye;
    lens->fx *= 0.85, lens->fy *= 0.85;  // 94° across
    lens->k1 = -0.02, lens->k2 = 0.004, lens->k3 = -0.001;
  }
  expect_the_scene(rig);
}

}  // namespace
}  // namespace organbake
