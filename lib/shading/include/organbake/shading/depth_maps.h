// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "organbake/shading/grid.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {

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

}  // namespace organbake
