// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_maps.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "organbake/shading/grid_filters.h"

namespace organbake {

Eigen::Vector3d normal_at(const Plane& log_range, const RayGrid& rays, int column, int row) {
  const double x = rays.x(column), y = rays.y(row), s2 = 1 + x * x + y * y;
  const double p =
      derivative_at(&log_range.values[log_range.index(0, row)], column, log_range.width, 1) /
      rays.step_x;
  const double q =
      derivative_at(&log_range.values[column], row, log_range.height, log_range.width) /
      rays.step_y;
  // ln z = v − ½ ln(1+x²+y²); the surface z(x, y)·(x, y, 1) has the normal (a, b, −1 − xa − yb)
  // with a, b the slopes of ln z.
  const double a = p - x / s2, b = q - y / s2;
  return Eigen::Vector3d(a, b, -1 - x * a - y * b).normalized();
}

Plane depth_from_log_range(const Plane& log_range, const RayGrid& rays, const Mask& inside) {
  Plane depth(log_range.width, log_range.height, std::numeric_limits<float>::infinity());
  for (int row = 0; row < depth.height; ++row)
    for (int column = 0; column < depth.width; ++column) {
      if (!inside.at(column, row)) continue;
      const double x = rays.x(column), y = rays.y(row);
      depth.at(column, row) = static_cast<float>(std::exp(double(log_range.at(column, row))) /
                                                 std::sqrt(1 + x * x + y * y));
    }
  return depth;
}

std::vector<Eigen::Vector3f> normals_from_log_range(const Plane& log_range, const RayGrid& rays) {
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(log_range.size());
  for (int row = 0; row < log_range.height; ++row)
    for (int column = 0; column < log_range.width; ++column)
      normals.push_back(normal_at(log_range, rays, column, row).cast<float>());
  return normals;
}

std::vector<Eigen::Vector3f> smooth_normals_from_depth(const Plane& depth, const RayGrid& rays,
                                                       int radius) {
  Plane log_range(depth.width, depth.height);
  Mask known(depth.width, depth.height);
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const float z = depth.at(x, y);
      if (!(std::isfinite(z) && z > 0)) continue;
      known.at(x, y) = 1;
      log_range.at(x, y) = std::log(z * static_cast<float>(std::hypot(1.0, rays.x(x), rays.y(y))));
    }
  fill_outside(log_range, known);
  const Mask everywhere(depth.width, depth.height, 1);
  for (int pass = 0; pass < 2; ++pass) log_range = box_mean(log_range, everywhere, radius);
  return normals_from_log_range(log_range, rays);
}

}  // namespace organbake
