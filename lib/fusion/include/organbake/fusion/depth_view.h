// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Usual depths of a map: from what a scope works at to what it cannot reach.
inline constexpr double kNearestDepth_mm = 2, kFarthestDepth_mm = 2000;

// One depth map, and where it was taken.
struct DepthView {
  std::string name;       // to speak of it
  PosedCamera camera;     // of the depth map, which knows no distortion: that is left out
  Plane depth_mm;         // planar; not finite or not positive where there is nothing
  Plane confidence;       // 0…1; empty = 1 everywhere
  Rgb8Image color;        // of any size; empty = the view colours nothing
  Intrinsics color_lens;  // of the colour picture, with its distortion
  // How the colour picture's axes are turned against the depth map's (rectified eyes).
  Eigen::Matrix3d color_from_camera = Eigen::Matrix3d::Identity();
  bool relative = false;  // depth_mm is in a unit of this map alone
};

// A depth map as it is fused: its noise averaged over the surface it lies on.
struct SmoothView {
  PosedCamera camera;
  Plane depth_mm;                        // +inf where there is nothing
  std::vector<Eigen::Vector3f> normals;  // camera axes, towards the camera
  Plane weight;              // confidence × cos² of the angle of view; 0 where there is nothing
  double noise_mm = 0;       // of a pixel, as it came
  double resolution_px = 1;  // what the averaging leaves of detail

  // World point of a pixel that has depth.
  Eigen::Vector3d point_world_mm(int x, int y) const;
  Eigen::Vector3d normal_world(int x, int y) const;
};

// The same with all lengths of the map, or of where its camera stands, this many times as long.
void scale_depth(double factor, SmoothView& view);
void scale_place(double factor, SmoothView& view);

// Throws BadDataError that names the view: its size is not its camera's, it has no depth at all, or
// lengths that no scope has.
SmoothView smooth_view(const DepthView& view);

// The median of what the views show, of a sample of pixels; 0 of none.
double usual_depth_mm(std::span<const SmoothView> views);

// Depth, normal and weight where a world point is seen; weight 0 where nothing is.
struct SeenSurface {
  double point_z_mm = 0;  // of the point asked for
  double depth_mm = 0;
  Eigen::Vector3d normal_camera = Eigen::Vector3d::Zero();
  double weight = 0;
};
SeenSurface seen_at(const SmoothView& view, const Eigen::Vector3d& point_world_mm);

// Whether what is seen faces the way that a point of that normal does: not the organ's other side.
bool is_same_side(const SmoothView& view, const SeenSurface& seen,
                  const Eigen::Vector3d& normal_world);

}  // namespace organbake
