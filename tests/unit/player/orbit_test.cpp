// SPDX-License-Identifier: Apache-2.0
#include "player/orbit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "organ_to_play.h"

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

TEST(OrbitView, RefusesWhatNobodyCanSee) {
  const CameraSet& cameras = organ_to_play().cameras;
  EXPECT_THROW(orbit_view(cameras, {}, 0, 10), UsageError);
  EXPECT_THROW(orbit_view(cameras, {0, 0, 0}, 10, 10), UsageError);
  EXPECT_THROW(orbit_view(cameras, {std::numeric_limits<double>::quiet_NaN()}, 10, 10), UsageError);
}

}  // namespace
}  // namespace organbake
