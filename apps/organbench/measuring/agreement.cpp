// SPDX-License-Identifier: GPL-3.0-or-later
// How near a result is to the truth: depths, ranges, and a scope's way after the best similarity
// (Umeyama 1991).
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "measuring/agreement.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/quantile.h"

namespace organbake {
namespace {

double mean_of(const Plane& plane) {
  double sum = 0;
  for (const float value : plane.values) sum += value;
  return sum / static_cast<double>(plane.size());
}

}  // namespace

double range_error_percent(const Plane& log_range, const Plane& truth) {
  const double shift = mean_of(truth) - mean_of(log_range);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += std::abs(std::exp(log_range.values[k] + shift - truth.values[k]) - 1);
  return 100 * sum / static_cast<double>(truth.size());
}

Eigen::Vector3d texel_point(const PosedCamera& camera, std::size_t texel, double depth_mm) {
  const std::size_t width = std::size_t(camera.intrinsics.width);
  const Ray ray =
      CameraRays(camera).through(double(texel % width) + 0.5, double(texel / width) + 0.5);
  return ray.origin + depth_mm * ray.direction;
}

namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

bool is_depth(float value) { return std::isfinite(value) && value > 0; }

std::vector<double> ranks_of(const std::vector<float>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t i, std::size_t j) { return values[i] < values[j]; });
  std::vector<double> ranks(values.size());
  for (std::size_t first = 0, last = 0; first < order.size(); first = last) {
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (std::size_t k = first; k < last; ++k)
      ranks[order[k]] = 0.5 * static_cast<double>(first + last - 1);
  }
  return ranks;
}

}  // namespace

void DepthPairs::add(float found_depth, float true_depth) {
  if (!is_depth(true_depth)) return;
  ++asked;
  if (!is_depth(found_depth)) return;
  found.push_back(found_depth);
  truth.push_back(true_depth);
}

void DepthPairs::add_maps(const Plane& found_depth, const Plane& true_depth) {
  for (int y = 0; y < found_depth.height; ++y)
    for (int x = 0; x < found_depth.width; ++x) {
      const Eigen::Vector2d pixel((x + 0.5) * true_depth.width / found_depth.width,
                                  (y + 0.5) * true_depth.height / found_depth.height);
      add(found_depth.at(x, y), depth_between(true_depth, pixel));
    }
}

DepthAgreement agreement_of(const DepthPairs& pairs) {
  if (pairs.found.empty()) throw std::invalid_argument("no pixel has both depths");
  std::vector<double> values;
  for (std::size_t i = 0; i < pairs.found.size(); ++i)
    values.push_back(double(pairs.truth[i]) / pairs.found[i]);
  DepthAgreement result;
  result.scale = median(values);
  for (double& value : values) value = 100 * std::abs(result.scale / value - 1);
  const auto count = static_cast<double>(values.size());
  result.mean_percent = std::accumulate(values.begin(), values.end(), 0.0) / count;
  result.median_percent = median(std::move(values));
  result.spearman = spearman(pairs.found, pairs.truth);
  result.covered_percent = 100 * count / static_cast<double>(pairs.asked);
  return result;
}

double spearman(const std::vector<float>& a, const std::vector<float>& b) {
  const std::vector<double> u = ranks_of(a), v = ranks_of(b);
  const double mean = 0.5 * (static_cast<double>(u.size()) - 1);
  double uv = 0, uu = 0, vv = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    uv += (u[i] - mean) * (v[i] - mean);
    uu += (u[i] - mean) * (u[i] - mean);
    vv += (v[i] - mean) * (v[i] - mean);
  }
  return uu > 0 && vv > 0 ? uv / std::sqrt(uu * vv) : 0;
}

float depth_between(const Plane& depth, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  if (!(x >= -0.5 && y >= -0.5 && x <= depth.width - 0.5 && y <= depth.height - 0.5)) return kNone;
  const int left = std::clamp(static_cast<int>(std::floor(x)), 0, depth.width - 1);
  const int top = std::clamp(static_cast<int>(std::floor(y)), 0, depth.height - 1);
  const int right = std::min(left + 1, depth.width - 1), down = std::min(top + 1, depth.height - 1);
  const double u = std::clamp(x - left, 0.0, 1.0), v = std::clamp(y - top, 0.0, 1.0);
  const float corners[] = {depth.at(left, top), depth.at(right, top), depth.at(left, down),
                           depth.at(right, down)};
  if (!std::all_of(std::begin(corners), std::end(corners), is_depth)) return kNone;
  return static_cast<float>((1 - v) * ((1 - u) * corners[0] + u * corners[1]) +
                            v * ((1 - u) * corners[2] + u * corners[3]));
}

std::vector<SeenPoint> nearest_points(const PosedCamera& camera,
                                      const std::vector<Eigen::Vector3d>& cloud, int cell_px) {
  const Intrinsics& lens = camera.intrinsics;
  std::map<std::pair<int, int>, SeenPoint> cells;
  for (const Eigen::Vector3d& point : cloud) {
    const Eigen::Vector3d at = camera.camera_from_world * point;
    if (at.z() <= 0) continue;
    const Eigen::Vector2d pixel = project(lens, at);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < lens.width && pixel.y() < lens.height))
      continue;
    const std::pair cell(static_cast<int>(pixel.x()) / cell_px,
                         static_cast<int>(pixel.y()) / cell_px);
    const SeenPoint seen{pixel, static_cast<float>(at.z())};
    const auto [place, is_first] = cells.try_emplace(cell, seen);
    if (!is_first && seen.depth < place->second.depth) place->second = seen;
  }
  std::vector<SeenPoint> result;
  for (const auto& [cell, seen] : cells) result.push_back(seen);
  return result;
}

std::optional<int> frame_of_name(const std::string& name) {
  constexpr std::size_t kMostDigits = 9;
  const std::string stem = name.substr(0, name.find_last_of('.'));
  const std::size_t before = stem.find_last_not_of("0123456789");
  const std::string digits = before == std::string::npos ? stem : stem.substr(before + 1);
  if (digits.empty() || digits.size() > kMostDigits) return {};
  return std::stoi(digits);
}

std::optional<PathError> path_error(const CameraSet& found, const CameraSet& truth) {
  std::map<int, Eigen::Vector3d> true_centers;
  for (const PosedCamera& camera : truth.cameras)
    if (const auto frame = frame_of_name(camera.name))
      true_centers[*frame] = camera.center_world_mm();
  std::vector<Eigen::Vector3d> from, to;
  for (const PosedCamera& camera : found.cameras) {
    const auto frame = frame_of_name(camera.name);
    const auto partner = frame ? true_centers.find(*frame) : true_centers.end();
    if (partner == true_centers.end()) continue;
    from.push_back(camera.center_world_mm());
    to.push_back(partner->second);
  }
  constexpr std::size_t kFewest = 3;
  if (from.size() < kFewest) return {};
  double extent_mm = 0, squares = 0;
  for (const Eigen::Vector3d& a : to)
    for (const Eigen::Vector3d& b : to) extent_mm = std::max(extent_mm, (a - b).norm());
  const auto count = static_cast<Eigen::Index>(from.size());
  const Eigen::Matrix4d true_from_found =
      Eigen::umeyama(Eigen::Matrix3Xd::Map(from[0].data(), 3, count),
                     Eigen::Matrix3Xd::Map(to[0].data(), 3, count), true);
  for (std::size_t i = 0; i < from.size(); ++i)
    squares += ((true_from_found * from[i].homogeneous()).head<3>() - to[i]).squaredNorm();
  return PathError{from.size(), 100 * std::sqrt(squares / double(from.size())) / extent_mm,
                   std::cbrt(true_from_found.topLeftCorner<3, 3>().determinant())};
}

}  // namespace organbake
