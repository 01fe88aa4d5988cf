// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/orbit.h"

#include <gtest/gtest.h>

#include <numbers>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "organ_to_play.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

TEST(OrbitView, StartsAtCameraZero) {
  const CameraSet& cameras = organ_to_play().cameras;
  const PosedCamera& first = cameras.cameras[0];
  const View view = orbit_view(cameras, {}, first.intrinsics.width, first.intrinsics.height);
  EXPECT_LT((view.camera.center_world_mm() - first.center_world_mm()).norm(), 1e-9);
  EXPECT_NEAR(view.camera.intrinsics.fx, first.intrinsics.fx, 1e-9);
}

TEST(OrbitView, AzimuthTurnsAboutTheVerticalAxis) {
  const CameraSet& cameras = organ_to_play().cameras;
  const Eigen::Vector3d center = cameras.manifold.center_world_mm;
  const Eigen::Vector3d start = orbit_view(cameras, {}, 64, 64).camera.center_world_mm() - center;
  for (const double angle : {0.705723, 2.44881, -1.0}) {
    const Eigen::Vector3d turned =
        orbit_view(cameras, {angle}, 64, 64).camera.center_world_mm() - center;
    const Eigen::Vector3d expected = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * start;
    EXPECT_LT((turned - expected).norm(), 1e-9 * start.norm());
  }
}

TEST(OrbitView, LooksAtTheCentreFromAnywhere) {
  const CameraSet& cameras = organ_to_play().cameras;
  for (const double elevation : {-2.0, -0.5, 0.0, 1.2, 3.0}) {  // beyond the poles it stops at them
    const View view = orbit_view(cameras, {0.3, elevation, 1.5, 0.4}, 200, 100);
    const Eigen::Vector2d middle = project(view.camera, cameras.manifold.center_world_mm);
    EXPECT_LT((middle - Eigen::Vector2d(100, 50)).norm(), 1e-6);
  }
}

// As bundles of laparoscopies have it: cameras in a cone about the view of the frame, whose own
// axes are the world's.
TEST(OrbitView, AScopesViewIsUprightAsFilmed) {
  CameraSet cameras = organ_to_play().cameras;
  cameras.manifold.center_world_mm = {1, 2, 60};
  for (const Eigen::Vector3d& beside : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(12, 0, 0)}) {
    cameras.cameras[0].camera_from_world =
        look_at(Eigen::Vector3d(1, 2, -40) + beside, {1, 2, 60}, Eigen::Vector3d(0, -1, 0));
    const auto upright = [&](const OrbitPose& pose) {
      return orbit_view(cameras, pose, 64, 64).camera.camera_from_world;
    };
    const RigidTransform first = upright({});
    EXPECT_LT((first.rotation - cameras.cameras[0].camera_from_world.rotation).norm(), 1e-9);
    EXPECT_LT((first.translation - cameras.cameras[0].camera_from_world.translation).norm(), 1e-9);
    // Elevation lifts the eye to the picture's top, azimuth moves it across, and both are angles.
    const RigidTransform lifted = upright({0, 0.3}), turned = upright({0.3, 0});
    EXPECT_LT((first * lifted.inverse().translation).y(), -20);
    EXPECT_NEAR((first * lifted.inverse().translation).x(), 0, 1e-9);
    EXPECT_NEAR((first * turned.inverse().translation).y(), 0, 1e-9);
    EXPECT_GT(std::abs((first * turned.inverse().translation).x()), 20);
    EXPECT_LT(turned.rotation(1, 1), 1 + 1e-12);
    EXPECT_GT(turned.rotation(1, 1), 0.99);  // y stays down
  }
}

TEST(OrbitView, TellsWhereItStopsAtAPole) {
  const CameraSet& cameras = organ_to_play().cameras;
  constexpr double kTurn_rad = 2 * std::numbers::pi;
  EXPECT_FALSE(leads_past_pole(cameras, {}));
  EXPECT_FALSE(leads_past_pole(cameras, {kTurn_rad, 0.1}));
  EXPECT_TRUE(leads_past_pole(cameras, {0, 0.49 * kTurn_rad}));
  EXPECT_TRUE(leads_past_pole(cameras, {0, -0.49 * kTurn_rad}));
}

TEST(OrbitView, RefusesWhatNobodyCanSee) {
  const CameraSet& cameras = organ_to_play().cameras;
  EXPECT_THROW(orbit_view(cameras, {}, 0, 10), UsageError);
  EXPECT_THROW(orbit_view(cameras, {0, 0, 0}, 10, 10), UsageError);
  EXPECT_THROW(orbit_view(cameras, {std::numeric_limits<double>::quiet_NaN()}, 10, 10), UsageError);
}

}  // namespace
}  // namespace organbake
