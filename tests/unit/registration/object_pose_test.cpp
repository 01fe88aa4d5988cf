// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/registration/object_pose.h"

#include <gtest/gtest.h>

#include <ceres/ceres.h>

#include "cost_functions/cost_functions.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "pose/poses.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Intrinsics lens(bool distorted) {
  Intrinsics k{640, 480, 700, 690, 322, 241};
  if (distorted) {
    k.k1 = -0.2;
    k.k2 = 0.05;
    k.p1 = 0.001;
    k.p2 = -0.002;
    k.k3 = 0.01;
  }
  return k;
}

ObjectPose some_pose() {
  ObjectPose pose;
  pose.camera_from_world = Eigen::Quaterniond(0.5, -0.3, 0.7, 0.2).normalized();
  pose.center_camera_mm = {12, -7, 300};
  return pose;
}

TEST(ObjectPose, ComesBackFromTheTransform) {
  const Vector3d center(40, -30, 20);
  const ObjectPose pose = some_pose();
  const ObjectPose again = object_pose(rigid_transform(pose, center), center);
  EXPECT_LT(motion_between(pose, again).norm(), 1e-12);
}

TEST(ObjectPose, MotionBetweenIsWhatMoved) {
  Motion motion;
  motion << 0.3, -0.5, 0.2, 4, -2, 7;
  EXPECT_LT((motion_between(some_pose(), moved(some_pose(), motion)) - motion).norm(), 1e-12);
}

TEST(ObjectPose, PixelMotionIsTheFiniteDifferences) {
  for (const bool distorted : {false, true}) {
    const Intrinsics k = lens(distorted);
    const ObjectPose pose = some_pose();
    const Vector3d from_center(25, 40, -30);
    const auto pixel = [&](const Motion& motion) {
      const ObjectPose at = moved(pose, motion);
      return project(k, at.camera_from_world * from_center + at.center_camera_mm);
    };
    const Vector3d x = pose.camera_from_world * from_center + pose.center_camera_mm;
    const auto analytic = pixel_motion(k, x, pose.center_camera_mm);
    constexpr double kStep = 1e-5;
    for (int j = 0; j < 6; ++j) {
      const Motion step = kStep * Motion::Unit(j);
      const Eigen::Vector2d difference = (pixel(step) - pixel(-step)) / (2 * kStep);
      EXPECT_LT((difference - analytic.col(j)).norm(), 1e-6 * (1 + analytic.col(j).norm()))
          << "parameter " << j << (distorted ? ", distorted" : "");
    }
  }
}

TEST(PoseManifold, FollowsCeresRules) {
  const auto x = some_pose().to_array();
  const PoseManifold manifold;
  const auto plus = PoseManifold::plus_jacobian(x.data());
  EXPECT_LT(
      (PoseManifold::minus_jacobian(x.data()) * plus - Eigen::Matrix<double, 6, 6>::Identity())
          .norm(),
      1e-12);
  Motion delta;
  delta << 0.1, 0.2, -0.3, 1, 2, 3;
  std::array<double, 7> y{};
  ASSERT_TRUE(manifold.Plus(x.data(), delta.data(), y.data()));
  Motion back;
  ASSERT_TRUE(manifold.Minus(y.data(), x.data(), back.data()));
  EXPECT_LT((back - delta).norm(), 1e-12);
  constexpr double kStep = 1e-6;
  for (int j = 0; j < 6; ++j) {
    std::array<double, 7> more{}, less{};
    const Motion step = kStep * Motion::Unit(j), other = -step;
    manifold.Plus(x.data(), step.data(), more.data());
    manifold.Plus(x.data(), other.data(), less.data());
    for (int i = 0; i < 7; ++i) EXPECT_NEAR((more[i] - less[i]) / (2 * kStep), plus(i, j), 1e-8);
  }
}

TEST(Reduced, KeepsRaysInPlace) {
  const Intrinsics k = lens(true), half = reduced(k, 4);
  const Vector3d x(30, -20, 250);
  EXPECT_LT((project(k, x) / 4 - project(half, x)).norm(), 1e-12);
}

const Intrinsics kLens{800, 600, 900, 910, 405, 296, -0.1, 0.02};

RigidTransform pairs_truth() { return look_at({150, -220, 90}, {5, 3, -4}, {0, 0, 1}); }

std::vector<PointPair> pairs(int count, double noise_px) {
  RandomStream random(11);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    PointPair pair;
    pair.point_world_mm = {random.uniform(-50, 50), random.uniform(-50, 50),
                           random.uniform(-50, 50)};
    pair.pixel = project(kLens, pairs_truth() * pair.point_world_mm) +
                 noise_px * Eigen::Vector2d(random.normal(), random.normal());
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(PosePairs, ExactPairsGiveTheExactPose) {
  const RigidTransform found = pose_from_pairs(pairs(6, 0), kLens);
  EXPECT_LT((found.rotation - pairs_truth().rotation).norm(), 1e-6);
  EXPECT_LT((found.translation - pairs_truth().translation).norm(), 1e-4);
}

TEST(PosePairs, OneWrongClickHardlyMatters) {
  std::vector<PointPair> clicked = pairs(12, 0.5);
  clicked[4].pixel += Eigen::Vector2d(60, -40);
  const RigidTransform found = pose_from_pairs(clicked, kLens);
  EXPECT_LT((found.rotation - pairs_truth().rotation).norm(), 0.02);
  EXPECT_LT((found.translation - pairs_truth().translation).norm(), 3) << "mm, from 270 mm away";
}

TEST(PosePairs, TooFewOrFlatOnesAreRefused) {
  EXPECT_THROW(pose_from_pairs(pairs(5, 0), kLens), UsageError);
  std::vector<PointPair> flat = pairs(8, 0);
  for (PointPair& pair : flat) {
    pair.point_world_mm.z() = 0;
    pair.pixel = project(kLens, pairs_truth() * pair.point_world_mm);
  }
  EXPECT_THROW(pose_from_pairs(flat, kLens), UsageError);
}

}  // namespace
}  // namespace organbake
