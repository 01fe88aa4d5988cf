// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/path_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace organbake {
namespace {

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

TEST(PathAlignment, ASimilarityIsFoundAgain) {
  const std::vector<Vector3d> points = {{0, 0, 0}, {3, 0, 1}, {0, 2, 5}, {1, 1, 1}, {-4, 2, 0}};
  std::vector<Vector3d> partners;
  for (const Vector3d& p : points) partners.push_back(0.3 * (kTurn * p) + Vector3d(5, -6, 7));
  const SimilarityTransform found = aligning_similarity(points, partners);
  EXPECT_NEAR(found.scale, 0.3, 1e-12);
  EXPECT_LT((found.rotation - kTurn).norm(), 1e-12);
  EXPECT_LT((found * points[1] - partners[1]).norm(), 1e-12);
}

TEST(PathAlignment, TheSamePathInAnotherWorldHasNoError) {
  const CameraSet truth = helix(30);
  const auto error = path_error(moved(truth, 0.1, kTurn, {1, 2, 3}), truth);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->frames, 30u);
  EXPECT_LT(error->rms_percent, 1e-9);
  EXPECT_LT(error->turn_deg, 1e-5);
  EXPECT_NEAR(error->truth_from_found.scale, 10, 1e-9);
}

// Every other centre is off by 1 % of the extent to one side and the rest to the other: the
// alignment cannot take that up.
TEST(PathAlignment, TheErrorIsAShareOfTheExtent) {
  const CameraSet truth = helix(40);
  const double extent = path_error(truth, truth)->extent_mm;
  CameraSet found = truth;
  for (std::size_t i = 0; i < found.cameras.size(); ++i) {
    RigidTransform& pose = found.cameras[i].camera_from_world;
    const Vector3d off(0, 0, (i % 2 ? 0.01 : -0.01) * extent);
    pose.translation -= pose.rotation * off;
  }
  const auto error = path_error(found, truth);
  EXPECT_NEAR(error->rms_percent, 1, 0.02);
  EXPECT_NEAR(error->largest_percent, 1, 0.1);
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

TEST(PathAlignment, BetweenFramesThePathGoesStraightOn) {
  CameraSet truth = helix(11), sparse = truth;
  sparse.cameras = {truth.cameras[2], truth.cameras[6]};
  const auto middle = camera_at_frame(sparse, 4);
  ASSERT_TRUE(middle);
  EXPECT_LT((middle->center_world_mm() - truth.cameras[4].center_world_mm()).norm(), 0.5);
  EXPECT_TRUE(is_rotation(middle->camera_from_world.rotation, 1e-9));
  EXPECT_EQ(camera_at_frame(sparse, 6)->center_world_mm(), truth.cameras[6].center_world_mm());
  EXPECT_FALSE(camera_at_frame(sparse, 1));
  EXPECT_FALSE(camera_at_frame(sparse, 7));
}

}  // namespace
}  // namespace organbake
