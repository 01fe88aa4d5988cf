// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "organbake/geometry/camera.h"

namespace organbake {

// A pose as the solver moves it: rotations turn the object about its own centre, not about the
// camera, so that turning and shifting hardly trade against each other.
struct ObjectPose {
  Eigen::Quaterniond camera_from_world = Eigen::Quaterniond::Identity();  // unit
  Eigen::Vector3d center_camera_mm = Eigen::Vector3d::Zero();

  // Seven numbers for the solver: quaternion x, y, z, w, then the centre.
  std::array<double, 7> to_array() const;
  static ObjectPose from_array(const double* values);
};

ObjectPose object_pose(const RigidTransform& camera_from_world,
                       const Eigen::Vector3d& center_world_mm);
RigidTransform rigid_transform(const ObjectPose& pose, const Eigen::Vector3d& center_world_mm);

// A small motion (ω, τ), in radians and mm along the camera's axes:
//   x' = Exp(ω)(x − c) + c + τ,   c the object's centre.
using Motion = Eigen::Matrix<double, 6, 1>;
ObjectPose moved(const ObjectPose& pose, const Motion& motion);
// The motion from `from` to `to`: moved(from, result) = to.
Motion motion_between(const ObjectPose& from, const ObjectPose& to);

// d pixel / d camera point (mm), distortion included; the point lies in front of the camera.
Eigen::Matrix<double, 2, 3> projection_jacobian(const Intrinsics& intrinsics,
                                                const Eigen::Vector3d& point_camera_mm);
// d pixel / d (ω, τ) of an object point now at `point_camera_mm`.
Eigen::Matrix<double, 2, 6> pixel_motion(const Intrinsics& intrinsics,
                                         const Eigen::Vector3d& point_camera_mm,
                                         const Eigen::Vector3d& center_camera_mm);

// The same lens on an image reduced by `factor` (a power of two).
Intrinsics reduced(const Intrinsics& intrinsics, int factor);

}  // namespace organbake
