// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>

#include "organbake/geometry/rigid_transform.h"

namespace organbake {

// What the distortion's coefficients mean.
enum class LensModel {
  brown,   // k1 k2 p1 p2 k3 on the plane z = 1
  fisheye  // k1 k2 k3 k4 on the angle to the axis (camera.cpp)
};

// A camera's lens, OpenCV's axes (x right, y down, z forward). Pixel units; the centre of the first
// pixel is (0.5, 0.5).
struct Intrinsics {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  double k4 = 0;  // of a fisheye
  LensModel model = LensModel::brown;

  bool has_distortion() const {
    return model == LensModel::fisheye || k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0;
  }
  // Throws BadDataError naming the field: sizes in 1…65536, focal lengths in 0.001…1e9, all finite.
  void check() const;
};

struct PosedCamera {
  std::string name;
  Intrinsics intrinsics;
  RigidTransform camera_from_world;

  Eigen::Vector3d center_world_mm() const { return camera_from_world.inverse().translation; }
  Eigen::Vector3d view_direction_world() const {
    return camera_from_world.rotation.row(2).transpose();
  }
};

// Pixel of a camera-space point (mm) with z > 0 (a fisheye sees the others, too), distortion
// applied.
Eigen::Vector2d project(const Intrinsics& intrinsics, const Eigen::Vector3d& point_camera_mm);
inline Eigen::Vector2d project(const PosedCamera& camera, const Eigen::Vector3d& point_world_mm) {
  return project(camera.intrinsics, camera.camera_from_world * point_world_mm);
}

// Camera-space ray through a pixel, scaled so that z = 1: point = planar depth × ray. Distortion is
// undone to 1e-12, by fixed-point iteration, a fisheye's by Newton's.
Eigen::Vector3d unproject(const Intrinsics& intrinsics, const Eigen::Vector2d& pixel);

// A picture's width or height as a document has it, in pixels: the whole number below, or 0, which
// Intrinsics::check() refuses, for what an int cannot hold.
inline int written_size(double number) {
  return std::isfinite(number) && std::abs(number) <= std::numeric_limits<int>::max()
             ? static_cast<int>(number)
             : 0;
}

// Of a fisheye's picture this much is straightened: beyond, pixels of a pinhole are drawn out to
// several times their size.
inline constexpr double kWidestPinhole_rad = 2.0943951023931953;  // 120°

// Angle between the rays at the middle of the picture's left and right side.
double angle_across_rad(const Intrinsics& lens);

// The camera without distortion whose picture stands for that of `lens` when its distortion is
// undone, of the same size and principal point. Brown's: of the same focal lengths. A fisheye's:
// the focal length at which each side shows what the fisheye has there, or 60° from the axis.
Intrinsics pinhole_of(const Intrinsics& lens);

// The lens of the same picture at another size. Halved sizes may have lost an odd row or column:
// they are halved exactly.
Intrinsics scaled_lens(const Intrinsics& lens, int width, int height);

// Whether a picture of this size is the lens's at another size, but for pixels that halving loses.
bool is_scaled_picture(const Intrinsics& lens, int width, int height);

}  // namespace organbake
