// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "shading/frame.h"
#include "shading/ray_grid.h"

namespace organbake {

// How far the depth of each pixel can be trusted, 0…1: the cosine between surface and ray, times
// the signal over signal and noise, times how well the model explains the pixel. Filled pixels
// (highlights) have a quarter at most; instruments and the border 0.
//   log_range: relative ln r of albedo 1 for intensity / intensity_unit; noise: share of the unit.
Plane confidence_map(const PreparedFrame& frame, const Plane& log_range,
                     const std::vector<Eigen::Vector3f>& normals, const RayGrid& rays,
                     double intensity_unit, double noise);

}  // namespace organbake
