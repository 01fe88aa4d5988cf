// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/scope_path.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace organbake {
namespace {

constexpr ScopePath kAll[] = {ScopePath::still, ScopePath::slide, ScopePath::approach,
                              ScopePath::turn,  ScopePath::orbit, ScopePath::tour,
                              ScopePath::zoom};

Eigen::Vector3d center(ScopePath path, double share) {
  return scope_pose(path, share).camera_from_world.inverse().translation;
}

double turned_rad(ScopePath path, double from, double to) {
  const Eigen::Matrix3d turn = scope_pose(path, to).camera_from_world.rotation *
                               scope_pose(path, from).camera_from_world.rotation.transpose();
  return Eigen::AngleAxisd(turn).angle();
}

TEST(ScopePath, PosesAreRigidAndSmooth) {
  constexpr int kSteps = 120;
  for (const ScopePath path : kAll)
    for (int i = 0; i < kSteps; ++i) {
      const double share = double(i) / kSteps, next = double(i + 1) / kSteps;
      EXPECT_TRUE(is_rotation(scope_pose(path, share).camera_from_world.rotation, 1e-9));
      // A hand moves less than this from frame to frame.
      EXPECT_LT((center(path, next) - center(path, share)).norm(), 3.0);
      EXPECT_LT(turned_rad(path, share, next), 0.06);
    }
}

TEST(ScopePath, WhatHasNoParallaxStaysWhereItIs) {
  for (const ScopePath path : {ScopePath::still, ScopePath::turn, ScopePath::zoom})
    for (const double share : {0.1, 0.5, 0.9, 1.0}) EXPECT_EQ(center(path, share), center(path, 0));
  EXPECT_EQ(turned_rad(ScopePath::still, 0, 0.7), 0);
  EXPECT_GT(turned_rad(ScopePath::turn, 0, 0.25), 0.2);
  EXPECT_EQ(scope_pose(ScopePath::zoom, 0).zoom, 1);
  EXPECT_GT(scope_pose(ScopePath::zoom, 1).zoom, 1.5);
  EXPECT_EQ(scope_pose(ScopePath::tour, 1).zoom, 1);
}

TEST(ScopePath, LoopsCloseAndTheOthersTravel) {
  for (const ScopePath path : {ScopePath::orbit, ScopePath::tour}) {
    EXPECT_LT((center(path, 1) - center(path, 0)).norm(), 0.5);
    EXPECT_LT(turned_rad(path, 0, 1), 0.02);
    EXPECT_GT((center(path, 0.4) - center(path, 0)).norm(), 20);
  }
  EXPECT_GT((center(ScopePath::slide, 1) - center(ScopePath::slide, 0)).x(), 50);
  EXPECT_GT((center(ScopePath::approach, 1) - center(ScopePath::approach, 0)).z(), 35);
}

}  // namespace
}  // namespace organbake
