// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/error_measures.h"

#include <algorithm>
#include <cmath>

#include "organbake/capture/traced_surface.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

double mean_of(const Plane& plane) {
  double sum = 0;
  for (const float value : plane.values) sum += value;
  return sum / static_cast<double>(plane.size());
}

}  // namespace

double radial_rms_mm(const TriangleMesh& mesh, double radius_mm) {
  double squares = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) squares += std::pow(v.norm() - radius_mm, 2);
  return std::sqrt(squares / double(mesh.vertices.size()));
}

double range_error_percent(const Plane& log_range, const Plane& truth) {
  const double shift = mean_of(truth) - mean_of(log_range);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += std::abs(std::exp(log_range.values[k] + shift - truth.values[k]) - 1);
  return 100 * sum / static_cast<double>(truth.size());
}

double depth_error_px(const Plane& depth, const Plane& truth) {
  const double shift = mean_of(truth) - mean_of(depth);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += std::abs(depth.values[k] + shift - truth.values[k]);
  return sum / static_cast<double>(truth.size());
}

Rgb8Image with_noise(Rgb8Image image, std::uint64_t seed) {
  RandomStream random(seed);
  for (std::uint8_t& level : image.pixels)
    level = std::uint8_t(std::clamp(std::lround(level + random.normal()), 0L, 255L));
  return image;
}

Ray texel_ray(const PosedCamera& camera, std::size_t texel) {
  const std::size_t width = std::size_t(camera.intrinsics.width);
  return CameraRays(camera).through(double(texel % width) + 0.5, double(texel / width) + 0.5);
}

Eigen::Vector3d texel_point(const PosedCamera& camera, std::size_t texel, double depth_mm) {
  const Ray ray = texel_ray(camera, texel);
  return ray.origin + depth_mm * ray.direction;
}

}  // namespace organbake
