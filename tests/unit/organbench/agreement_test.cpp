// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/agreement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"
#include "peers/peers.h"

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

// Three cameras side by side, a unit apart, looking along z.
constexpr const char* kCameras = "1 PINHOLE 100 100 50 50 50 50\n";
constexpr const char* kImages =
    "# comment\n"
    "1 1 0 0 0 0 0 0 1 a_000000.png\n55.5 50 1\n"
    "2 1 0 0 0 -1 0 0 1 a_000005.png\n50 50.5 1 49 50 2\n"
    "7 1 0 0 0 -2 0 0 1 a_000010.png\n45 50 1\n";

TEST(ColmapModel, PointsCarryTheirSightingsAndAngles) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "cameras.txt", std::string_view(kCameras));
  write_file_atomically(folder.path() / "images.txt", std::string_view(kImages));
  write_file_atomically(folder.path() / "points3D.txt",
                        std::string_view("# comment\n"
                                         "1 1 0 10 200 100 90 0 1 0 2 0 7 0\n"
                                         "2 0 0 50 200 100 90 0.9 2 1 2 0\n"
                                         "3 1 0 1000 0 0 0 0.1 1 0 2 0 7 0\n"
                                         "4 1 0 10 0 0 0 0.7\n"));
  const std::vector<ModelPoint> points = read_model_points(folder.path());
  ASSERT_EQ(points.size(), 4u);
  EXPECT_EQ(points[0].sightings, 3u);
  EXPECT_NEAR(points[0].largest_angle_deg, 11.421, 1e-3);  // 2 · atan(1/10)
  EXPECT_NEAR(points[0].error_px, 1.0 / 3, 1e-12);         // half a pixel in two frames of three
  EXPECT_EQ(points[1].sightings, 1u);                      // one frame sees it twice
  EXPECT_EQ(points[3].error_px, 0.7);                      // without a track
  const ModelQuality quality = quality_of(points);
  EXPECT_EQ(quality.points, 1u);  // the others: one frame only; an angle of 0.1 degrees
  EXPECT_NEAR(quality.reprojection_px, 1.0 / 3, 1e-12);
}

TEST(ColmapModel, WhatIsNoPointIsRefused) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "cameras.txt", std::string_view(kCameras));
  write_file_atomically(folder.path() / "images.txt", std::string_view(kImages));
  write_file_atomically(folder.path() / "points3D.txt", std::string_view("1 2 three\n"));
  EXPECT_THROW(read_model_points(folder.path()), BadDataError);
  EXPECT_THROW(read_model_points(folder.path() / "none"), NoInputError);
}

}  // namespace
}  // namespace organbake
