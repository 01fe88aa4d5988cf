// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_depth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace organbake {

Plane confidence_map(const PreparedFrame& frame, const Plane& log_range,
                     const std::vector<Eigen::Vector3f>& normals, const RayGrid& rays,
                     double intensity_unit, double noise) {
  constexpr double kFilled = 0.25, kMisfit = 0.15;
  Plane confidence(rays.width, rays.height);
  for (int y = 0; y < rays.height; ++y)
    for (int x = 0; x < rays.width; ++x) {
      const std::size_t k = confidence.index(x, y);
      if (!frame.tissue.values[k]) continue;
      const Eigen::Vector3d ray = Eigen::Vector3d(rays.x(x), rays.y(y), 1).normalized();
      const double cosine = std::max(0.0, -normals[k].cast<double>().dot(ray));
      double value = cosine;
      if (!frame.counts.values[k]) {
        value *= kFilled;
      } else {
        const double signal = frame.intensity.values[k] / intensity_unit;
        const double model = std::exp(-2.0 * log_range.values[k]) * cosine;
        const double misfit = (signal - model) / std::max(model, 1e-6) / kMisfit;
        value *= signal / (signal + 3 * noise + 0.02) / (1 + misfit * misfit);
      }
      confidence.values[k] = static_cast<float>(std::clamp(value, 0.0, 1.0));
    }
  return confidence;
}

}  // namespace organbake
