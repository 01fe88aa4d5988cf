// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/camera.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// Throws BadDataError naming the camera when its intrinsics or its pose cannot be used.
void check_camera(const PosedCamera& camera);

// Rays of one camera, z = 1 in camera space, so that a hit's t is its planar depth.
class CameraRays {
 public:
  explicit CameraRays(const PosedCamera& camera)
      : lens_(camera.intrinsics),
        eye_(camera.center_world_mm()),
        world_from_camera_(camera.camera_from_world.rotation.transpose()) {}

  Ray through(double x_px, double y_px) const {
    Ray ray;
    ray.origin = eye_;
    ray.direction = world_from_camera_ * unproject(lens_, {x_px, y_px});
    return ray;
  }
  // The coarser of the two axes: what one pixel spans at depth 1.
  double focal_px() const { return lens_.fx < lens_.fy ? lens_.fx : lens_.fy; }

 private:
  Intrinsics lens_;
  Eigen::Vector3d eye_;
  Eigen::Matrix3d world_from_camera_;
};

}  // namespace organbake
