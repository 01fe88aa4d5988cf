// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <Eigen/LU>

#include <algorithm>
#include <set>

#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(PhotoCameras, EachFramesTheWholeOrganClosely) {
  OrganPhantomOptions options;
  options.photo_count = 11;
  options.photo_size = 640;
  const OrganPhantom phantom(options);
  const std::vector<Vector3d> vertices = phantom.surface(5).vertices;
  const std::vector<PosedCamera> cameras = phantom.photo_cameras();
  ASSERT_EQ(cameras.size(), 11u);
  for (const PosedCamera& camera : cameras) {
    EXPECT_NO_THROW(camera.intrinsics.check());
    double least_margin = 640;
    for (const Vector3d& vertex : vertices) {
      EXPECT_GT((camera.camera_from_world * vertex).z(), 0);
      const Vector2d pixel = project(camera, vertex);
      least_margin =
          std::min({least_margin, pixel.x(), pixel.y(), 640 - pixel.x(), 640 - pixel.y()});
    }
    EXPECT_GT(least_margin, 0.02 * 640) << camera.name;
    EXPECT_LT(least_margin, 0.04 * 640) << camera.name << ": wastes its frame";
  }
}

TEST(PhotoCameras, AreProperPosesFromAllRound) {
  OrganPhantomOptions options;
  options.photo_count = 12;
  const std::vector<PosedCamera> cameras = OrganPhantom(options).photo_cameras();
  std::set<std::string> names;
  Vector3d mean = Vector3d::Zero();
  for (const PosedCamera& camera : cameras) {
    const Eigen::Matrix3d& rotation = camera.camera_from_world.rotation;
    EXPECT_LT((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(rotation.determinant(), 1, 1e-12);
    names.insert(camera.name);
    mean += camera.view_direction_world() / 12;
    // Neither square pixels nor a centred axis: what tells a swapped intrinsic.
    EXPECT_NE(camera.intrinsics.fx, camera.intrinsics.fy);
    EXPECT_NE(camera.intrinsics.cx, camera.intrinsics.cy);
    EXPECT_NE(camera.intrinsics.cx, 0.5 * camera.intrinsics.width);
  }
  EXPECT_EQ(names.size(), 12u);
  EXPECT_LT(mean.norm(), 0.1);
}

TEST(PhotoCameras, OnePhotoWorksToo) {
  OrganPhantomOptions options;
  options.photo_count = 1;
  EXPECT_EQ(OrganPhantom(options).photo_cameras().size(), 1u);
}

}  // namespace
}  // namespace organbake
