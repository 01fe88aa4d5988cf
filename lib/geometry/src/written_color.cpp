// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/written_color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace organbake {
namespace {

double highest(const std::vector<Eigen::Vector3d>& colors) {
  double most = 0;
  for (const Eigen::Vector3d& c : colors) most = std::max(most, c.maxCoeff());
  return most;
}

double full_scale(const std::vector<Eigen::Vector3d>& written, ColorScale scale) {
  if (scale == ColorScale::byte) return 255;
  if (scale == ColorScale::two_bytes) return 65535;
  const double most = highest(written);
  return most <= 1 ? 1 : most <= 255 ? 255 : 65535;
}

// In float, as images are: geometry stands above image and its tables.
float linear(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

}  // namespace

std::vector<Eigen::Vector3f> linear_colors(const std::vector<Eigen::Vector3d>& written,
                                           ColorScale scale) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(written.size());
  const auto full =
      static_cast<float>(scale == ColorScale::linear ? 1.0 : full_scale(written, scale));
  for (const Eigen::Vector3d& w : written) {
    const Eigen::Vector3f color = w.cast<float>();
    colors.push_back(
        scale == ColorScale::linear ? color : Eigen::Vector3f((color / full).unaryExpr(&linear)));
  }
  return colors;
}

std::vector<Eigen::Vector3f> vertex_from_face_colors(
    const std::vector<std::array<std::uint32_t, 3>>& faces,
    const std::vector<Eigen::Vector3f>& face_colors, std::size_t vertex_count) {
  std::vector<Eigen::Vector3f> colors(vertex_count, Eigen::Vector3f::Zero());
  std::vector<float> uses(vertex_count, 0.0f);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t v : faces[f]) {
      colors[v] += face_colors[f];
      ++uses[v];
    }
  }
  for (std::size_t v = 0; v < vertex_count; ++v) colors[v] /= std::max(uses[v], 1.0f);
  return colors;
}

}  // namespace organbake
