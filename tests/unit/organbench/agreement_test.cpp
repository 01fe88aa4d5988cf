// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/agreement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "organbake/core/random.h"

namespace organbake {
namespace {

TEST(DepthAgreement, OneScaleIsTakenOutAndNoMore) {
  DepthPairs pairs;
  RandomStream random(1);
  for (int i = 0; i < 4000; ++i) {
    const double truth = random.uniform(30, 90), off = i % 2 ? 1.02 : 0.98;
    pairs.add(static_cast<float>(0.1 * truth * off), static_cast<float>(truth));
  }
  const DepthAgreement found = agreement_of(pairs);
  EXPECT_NEAR(found.scale, 10, 0.25);
  EXPECT_NEAR(found.mean_percent, 2, 0.15);
  EXPECT_GT(found.spearman, 0.99);
  EXPECT_EQ(found.covered_percent, 100);
}

TEST(DepthAgreement, WhatIsMissingLowersTheCoverageAlone) {
  DepthPairs pairs;
  for (int i = 1; i <= 100; ++i)
    pairs.add(i <= 80 ? static_cast<float>(i) : INFINITY, static_cast<float>(i));
  pairs.add(5, INFINITY);  // without a truth it is not asked for
  const DepthAgreement found = agreement_of(pairs);
  EXPECT_EQ(found.covered_percent, 80);
  EXPECT_EQ(found.mean_percent, 0);
  EXPECT_THROW(agreement_of(DepthPairs{}), std::invalid_argument);
}

TEST(DepthAgreement, RanksAreCompared) {
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {1, 4, 9, 16}), 1);
  EXPECT_DOUBLE_EQ(spearman({1, 2, 3, 4}, {4, 3, 2, 1}), -1);
  // By hand: ranks 0.5 0.5 2 3 and 0 1 2 3 give 4.5 / √(4.5 · 5).
  EXPECT_NEAR(spearman({1, 1, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(22.5), 1e-12);
  EXPECT_EQ(spearman({1, 1}, {1, 2}), 0);
}

// A plane's map at half the size agrees with the whole one to the last digit.
TEST(DepthAgreement, MapsOfOtherSizesMeetAtPixelCentres) {
  Plane whole(40, 20), half(20, 10);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 40; ++x) whole.at(x, y) = 50 + 0.5f * (x + 0.5f) + 0.25f * (y + 0.5f);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) half.at(x, y) = 50 + 1.0f * (x + 0.5f) + 0.5f * (y + 0.5f);
  whole.at(0, 0) = INFINITY;
  DepthPairs pairs;
  pairs.add_maps(half, whole);
  EXPECT_EQ(pairs.asked, 199u);
  EXPECT_LT(agreement_of(pairs).mean_percent, 1e-4);
}

TEST(DepthAgreement, PointsBehindNearerOnesAreHidden) {
  PosedCamera camera;
  camera.intrinsics = {100, 80, 50, 50, 50, 40};
  const std::vector<Eigen::Vector3d> cloud = {
      {0, 0, 10}, {0.1, 0.1, 12}, {0, 0, -5}, {5, 0, 10}, {50, 0, 10}};
  const auto seen = nearest_points(camera, cloud, 8);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].depth, 10);
  EXPECT_EQ(seen[0].pixel, Eigen::Vector2d(50, 40));
  EXPECT_EQ(seen[1].pixel, Eigen::Vector2d(75, 40));
}

using Eigen::Vector3d;

CameraSet helix(int frames) {
  CameraSet set;
  for (int i = 0; i < frames; ++i) {
    PosedCamera camera;
    camera.name = "frame_" + std::to_string(100000 + i).substr(1);
    camera.intrinsics = {640, 480, 500, 500, 320, 240};
    camera.camera_from_world = look_at({20 * std::cos(0.1 * i), 20 * std::sin(0.1 * i), 0.5 * i},
                                       {0, 0, 60}, Vector3d::UnitY());
    set.cameras.push_back(camera);
  }
  return set;
}

// The same cameras in another world: x_other = scale · turn · x + shift.
CameraSet moved(const CameraSet& set, double scale, const Eigen::Matrix3d& turn,
                const Vector3d& shift) {
  CameraSet result = set;
  for (PosedCamera& camera : result.cameras) {
    const Vector3d center = scale * (turn * camera.center_world_mm()) + shift;
    camera.camera_from_world.rotation = camera.camera_from_world.rotation * turn.transpose();
    camera.camera_from_world.translation = -(camera.camera_from_world.rotation * center);
  }
  return result;
}

const Eigen::Matrix3d kTurn =
    Eigen::AngleAxisd(1.1, Vector3d(1, 2, 3).normalized()).toRotationMatrix();

TEST(PathAlignment, TheSamePathInAnotherWorldHasNoError) {
  const CameraSet truth = helix(30);
  const auto error = path_error(moved(truth, 0.1, kTurn, {1, 2, 3}), truth);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->frames, 30u);
  EXPECT_LT(error->rms_percent, 1e-9);
  EXPECT_NEAR(error->scale, 10, 1e-9);
}

// Every other centre is off by 1 % of the extent to one side and the rest to the other: the
// alignment cannot take that up.
TEST(PathAlignment, TheErrorIsAShareOfTheExtent) {
  const CameraSet truth = helix(40);
  double extent = 0;
  for (const PosedCamera& a : truth.cameras)
    for (const PosedCamera& b : truth.cameras)
      extent = std::max(extent, (a.center_world_mm() - b.center_world_mm()).norm());
  CameraSet found = truth;
  for (std::size_t i = 0; i < found.cameras.size(); ++i) {
    RigidTransform& pose = found.cameras[i].camera_from_world;
    const Vector3d off(0, 0, (i % 2 ? 0.01 : -0.01) * extent);
    pose.translation -= pose.rotation * off;
  }
  EXPECT_NEAR(path_error(found, truth)->rms_percent, 1, 0.02);
}

TEST(PathAlignment, FramesAreMatchedByTheirNumbers) {
  EXPECT_EQ(frame_of_name("frame_000012.png"), 12);
  EXPECT_EQ(frame_of_name("frame_0005"), 5);
  EXPECT_EQ(frame_of_name("000120.exr"), 120);
  EXPECT_FALSE(frame_of_name("left"));
  EXPECT_FALSE(frame_of_name(""));
  const CameraSet truth = helix(30);
  CameraSet part = truth;
  part.cameras.erase(part.cameras.begin(), part.cameras.begin() + 20);
  part.cameras[0].name = "frame_00777.png";
  EXPECT_EQ(path_error(part, truth)->frames, 9u);
  part.cameras.resize(3);
  EXPECT_FALSE(path_error(part, truth));
}

}  // namespace
}  // namespace organbake
