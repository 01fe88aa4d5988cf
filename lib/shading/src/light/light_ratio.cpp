// SPDX-License-Identifier: GPL-3.0-or-later
// What a lamp beside the lens, or a beam, changes of the brightness under a lamp at the lens, pixel
// by pixel.
#include "organbake/shading/light_ratio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/shading/depth_maps.h"

namespace organbake {

Plane light_ratio(const Plane& log_range_mm, const RayGrid& rays,
                  const LaparoscopeOptions& options) {
  const Eigen::Vector3d light(options.light_offset_x_mm, options.light_offset_y_mm, 0);
  Plane ratio(rays.width, rays.height, 1);
  for (int row = 0; row < rays.height; ++row)
    for (int column = 0; column < rays.width; ++column) {
      const Eigen::Vector3d ray = Eigen::Vector3d(rays.x(column), rays.y(row), 1).normalized();
      const Eigen::Vector3d point = std::exp(double(log_range_mm.at(column, row))) * ray;
      const Eigen::Vector3d toward = light - point;
      const double distance = toward.norm(), range = point.norm();
      double value = 1;
      if (!light.isZero() && distance > 1e-6) {
        const Eigen::Vector3d normal = normal_at(log_range_mm, rays, column, row);
        const double lit = std::max(0.0, normal.dot(toward)) / distance;
        const double central = std::max(0.02, -normal.dot(ray));
        value = lit / central * (range * range) / (distance * distance);
      }
      const double cosine = distance > 1e-6 ? -toward.z() / distance : 1;
      value *= std::pow(std::max(cosine, 1e-3), options.beam_exponent);
      ratio.at(column, row) = static_cast<float>(std::clamp(value, 0.05, 20.0));
    }
  return ratio;
}

}  // namespace organbake
