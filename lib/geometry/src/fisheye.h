// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "organbake/geometry/camera.h"

namespace organbake {

// Kannala & Brandt 2006, as OpenCV's fisheye, ROS ("equidistant"), Kalibr and COLMAP write it: a
// ray at the angle θ to the axis meets the picture at θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) focal
// lengths from its centre.

// Place in focal lengths from the principal point of a camera-space point, which may lie beside the
// camera, too.
Eigen::Vector2d fisheye_place(const Intrinsics& lens, const Eigen::Vector3d& point_camera_mm);

// Camera-space ray of z = 1 that meets this place. Beyond 89.9° from the axis, and where the
// polynomial has ceased to rise, the widest ray that is known in that direction.
Eigen::Vector3d fisheye_ray(const Intrinsics& lens, const Eigen::Vector2d& place);

}  // namespace organbake
