// SPDX-License-Identifier: GPL-3.0-or-later
// A distant light from one picture, by statistics of its levels and its first moments: no surface
// is asked for, so that it can come before any.
#include "organbake/shading/light_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace organbake {
namespace {

constexpr int kBins = 256;

// The densest 2 % of the range of levels, its mean; `share` of the pixels that lie in it.
struct Ground {
  double level = 0, share = 0, width = 0;
};

Ground find_ground(const std::vector<float>& sorted) {
  const std::size_t n = sorted.size();
  const float span = 0.02F * (sorted.back() - sorted.front());
  Ground ground;
  std::size_t begin = 0, best = 0, best_begin = 0;
  for (std::size_t end = 0; end < n; ++end) {
    while (sorted[end] - sorted[begin] > span) ++begin;
    // Black is shadow, never a ground that is lit.
    if (sorted[begin] <= 0.01F * sorted.back()) continue;
    if (end + 1 - begin > best) {
      best = end + 1 - begin;
      best_begin = begin;
    }
  }
  if (best == 0) return {sorted[n / 2], 0, span};
  ground.level = sorted[best_begin + best / 2];
  ground.share = double(best) / n;
  ground.width = span;
  return ground;
}

}  // namespace

LightEstimate estimate_light(const Plane& intensity, const Mask& inside) {
  LightEstimate estimate;
  std::vector<float> sorted;
  for (std::size_t k = 0; k < intensity.size(); ++k)
    if (inside.values[k] && std::isfinite(intensity.values[k]))
      sorted.push_back(intensity.values[k]);
  estimate.frontal = true;
  estimate.tilt_error_rad = std::numbers::pi;
  estimate.slant_error_rad = std::numbers::pi / 4;
  if (sorted.empty()) return estimate;
  std::sort(sorted.begin(), sorted.end());
  estimate.albedo = sorted[std::min(sorted.size() - 1, sorted.size() * 995 / 1000)];
  if (!(estimate.albedo > 0) || sorted.back() <= sorted.front()) return estimate;
  const Ground ground = find_ground(sorted);
  const double cosine = std::clamp(ground.level / estimate.albedo, 0.0, 1.0);
  estimate.light.slant_rad = std::acos(cosine);
  const double sine = std::max(std::sin(estimate.light.slant_rad), 0.05);
  estimate.slant_error_rad =
      std::min(std::numbers::pi / 4, (ground.width / estimate.albedo + 0.02 / ground.share) / sine);

  // Four interleaved quarters of the rows tell how far the tilt can be trusted.
  std::array<Eigen::Vector2d, 4> parts;
  parts.fill(Eigen::Vector2d::Zero());
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  const auto relief = [&](std::size_t k) {
    return inside.values[k] && std::isfinite(intensity.values[k]) &&
           std::abs(intensity.values[k] - ground.level) > ground.width;
  };
  for (int y = 0; y < intensity.height; ++y)
    for (int x = 0; x < intensity.width; ++x)
      if (relief(intensity.index(x, y))) centre += Eigen::Vector3d(x, y, 1);
  if (centre.z() < 1) return estimate;
  centre /= centre.z();
  for (int y = 0; y < intensity.height; ++y)
    for (int x = 0; x < intensity.width; ++x) {
      const std::size_t k = intensity.index(x, y);
      if (!relief(k)) continue;
      const Eigen::Vector2d at(x - centre.x(), y - centre.y());
      parts[static_cast<std::size_t>(y % 4)] += (intensity.values[k] - ground.level) * at;
    }
  const Eigen::Vector2d direction = parts[0] + parts[1] + parts[2] + parts[3];
  if (direction.norm() <= 0) return estimate;
  estimate.light.tilt_rad = std::atan2(direction.y(), direction.x());
  double squares = 0;
  for (const Eigen::Vector2d& own : parts) {
    const double cross = direction.x() * own.y() - direction.y() * own.x();
    squares += std::pow(std::atan2(cross, direction.dot(own)), 2);
  }
  estimate.tilt_error_rad = std::sqrt(squares / 4) + 0.05 / sine;
  estimate.frontal = estimate.light.slant_rad < estimate.slant_error_rad;
  return estimate;
}

}  // namespace organbake
