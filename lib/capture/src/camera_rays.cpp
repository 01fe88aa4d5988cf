// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/camera_rays.h"

#include <Eigen/Geometry>

#include "organbake/core/error.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {

void check_camera(const PosedCamera& camera) {
  camera.intrinsics.check();
  const RigidTransform& pose = camera.camera_from_world;
  constexpr double kRounding = 1e-6;  // what a pose keeps after a trip through a text file
  const Eigen::Matrix3d product = pose.rotation * pose.rotation.transpose();
  if (!within_reach(pose.translation) ||
      !((product - Eigen::Matrix3d::Identity()).norm() < kRounding) ||
      pose.rotation.row(0).dot(pose.rotation.row(1).cross(pose.rotation.row(2))) < 0) {
    throw BadDataError("camera " + camera.name +
                       ": its pose is not a rotation and a finite translation within 1e9 mm");
  }
}

}  // namespace organbake
