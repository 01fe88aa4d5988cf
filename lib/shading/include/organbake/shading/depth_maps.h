// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// The rays of an undistorted camera's pixels in normalised coordinates: (x, y, 1).
struct RayGrid {
  int width = 0;
  int height = 0;
  double step_x = 0, step_y = 0;  // between neighbours: 1/fx, 1/fy
  double left = 0, top = 0;       // of the first pixel's centre

  double x(int column) const { return left + column * step_x; }
  double y(int row) const { return top + row * step_y; }
};

inline RayGrid ray_grid(const Intrinsics& camera) {
  return {camera.width,
          camera.height,
          1 / camera.fx,
          1 / camera.fy,
          (0.5 - camera.cx) / camera.fx,
          (0.5 - camera.cy) / camera.fy};
}

// The grid of half the size whose pixels cover 2×2 of this one (the last row and column fewer).
inline RayGrid halved(const RayGrid& fine) {
  return {(fine.width + 1) / 2, (fine.height + 1) / 2,         2 * fine.step_x,
          2 * fine.step_y,      fine.left + 0.5 * fine.step_x, fine.top + 0.5 * fine.step_y};
}

// Unit normal towards the camera (camera axes) of the surface r = e^v at one pixel, by central
// differences.
Eigen::Vector3d normal_at(const Plane& log_range, const RayGrid& rays, int column, int row);

// Planar depth z = r / √(1+x²+y²); +inf where the mask is zero.
Plane depth_from_log_range(const Plane& log_range, const RayGrid& rays, const Mask& inside);

// Normals of all pixels, row-major.
std::vector<Eigen::Vector3f> normals_from_log_range(const Plane& log_range, const RayGrid& rays);

// Of planar depth that is measured pixel by pixel: normals of its mean over squares of 2·radius + 1
// pixels, which noise does not turn about. Gaps (+inf) are bridged.
std::vector<Eigen::Vector3f> smooth_normals_from_depth(const Plane& depth, const RayGrid& rays,
                                                       int radius);

// The radius for depth that two eyes matched: as far as its errors hang together.
inline int smooth_normals_radius_px(const RayGrid& rays) {
  constexpr int kShare = 60;  // of the width
  return std::max(1, rays.width / kShare);
}

struct DepthMeshOptions {
  int step_px = 2;           // grid spacing
  double tear = 0.06;        // neighbours whose depths differ by more than this share aren't joined
  bool largest_only = true;  // keep the one largest piece

  void check() const;  // throws UsageError
};

// The surface that a depth map shows, in camera axes taken as world, coloured by the frame
// (linear; means over a step's pixels). Two triangles per grid cell, front to the camera, cut along
// a smooth curve a few pixels inside the border of the depth; cells with a gap or a jump stay
// open: nothing is invented where one viewpoint cannot have seen. Throws BadDataError when sizes
// differ or no cell is left.
TriangleMesh mesh_from_depth(const Plane& depth_mm, const Rgb8Image& color,
                             const Intrinsics& camera, const DepthMeshOptions& options);

}  // namespace organbake
