// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/shading/grid.h"

// What suites and trials hold results against.
namespace organbake {

// RMS over the vertices of their distance to a sphere round the origin.
double radial_rms_mm(const TriangleMesh& mesh, double radius_mm);

// Mean relative error of a range, one scale fitted; both are logarithms of ranges.
double range_error_percent(const Plane& log_range, const Plane& truth);
// Mean difference of a depth, one offset fitted; both in pixels.
double depth_error_px(const Plane& depth, const Plane& truth);

// A picture with the noise of a level or so in every value.
Rgb8Image with_noise(Rgb8Image image, std::uint64_t seed);

// Through the middle of a texel, counted row by row; z = 1 in camera space.
Ray texel_ray(const PosedCamera& camera, std::size_t texel);
Eigen::Vector3d texel_point(const PosedCamera& camera, std::size_t texel, double depth_mm);

}  // namespace organbake
