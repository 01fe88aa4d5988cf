// SPDX-License-Identifier: GPL-3.0-or-later
// How near a result is to the truth: depths, ranges, and a scope's way after the best similarity
// (Umeyama 1991).
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "measuring/agreement.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/quantile.h"
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

namespace {

using Eigen::Vector3d;

std::map<int, const PosedCamera*> by_frame(const CameraSet& set) {
  std::map<int, const PosedCamera*> result;
  for (const PosedCamera& camera : set.cameras)
    if (const auto frame = frame_of_name(camera.name)) result[*frame] = &camera;
  return result;
}

double extent(const std::vector<Vector3d>& points) {
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) largest = std::max(largest, (points[i] - points[j]).norm());
  return largest;
}

}  // namespace

SimilarityTransform aligning_similarity(const std::vector<Vector3d>& points,
                                        const std::vector<Vector3d>& partners) {
  Eigen::Matrix3Xd from(3, points.size()), to(3, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) from.col(i) = points[i], to.col(i) = partners[i];
  const Eigen::Matrix4d m = Eigen::umeyama(from, to, true);
  SimilarityTransform result;
  result.scale = std::cbrt(m.topLeftCorner<3, 3>().determinant());
  result.rotation = m.topLeftCorner<3, 3>() / result.scale;
  result.translation = m.topRightCorner<3, 1>();
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
  const auto true_ones = by_frame(truth);
  std::vector<const PosedCamera*> ours, theirs;
  std::vector<Vector3d> centers, true_centers;
  for (const auto& [frame, camera] : by_frame(found)) {
    const auto partner = true_ones.find(frame);
    if (partner == true_ones.end()) continue;
    ours.push_back(camera);
    theirs.push_back(partner->second);
    centers.push_back(camera->center_world_mm());
    true_centers.push_back(partner->second->center_world_mm());
  }
  if (centers.size() < 3) return {};
  PathError error{.frames = centers.size(),
                  .extent_mm = extent(true_centers),
                  .truth_from_found = aligning_similarity(centers, true_centers)};
  double squares = 0;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const double apart = (error.truth_from_found * centers[i] - true_centers[i]).norm();
    squares += apart * apart;
    error.largest_percent = std::max(error.largest_percent, 100 * apart / error.extent_mm);
    const Eigen::Matrix3d turn = ours[i]->camera_from_world.rotation *
                                 error.truth_from_found.rotation.transpose() *
                                 theirs[i]->camera_from_world.rotation.transpose();
    error.turn_deg += std::abs(Eigen::AngleAxisd(turn).angle()) * 180 / std::numbers::pi /
                      static_cast<double>(centers.size());
  }
  error.rms_percent =
      100 * std::sqrt(squares / static_cast<double>(centers.size())) / error.extent_mm;
  return error;
}

std::optional<PosedCamera> camera_at_frame(const CameraSet& set, int frame) {
  const auto cameras = by_frame(set);
  const auto after = cameras.lower_bound(frame);
  if (after == cameras.end()) return {};
  if (after->first == frame) return *after->second;
  if (after == cameras.begin()) return {};
  const auto before = std::prev(after);
  const double share = double(frame - before->first) / (after->first - before->first);
  const PosedCamera &a = *before->second, &b = *after->second;
  PosedCamera between = a;
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(a.camera_from_world.rotation)
          .slerp(share, Eigen::Quaterniond(b.camera_from_world.rotation));
  const Vector3d center = (1 - share) * a.center_world_mm() + share * b.center_world_mm();
  between.camera_from_world.rotation = turn.toRotationMatrix();
  between.camera_from_world.translation = -(between.camera_from_world.rotation * center);
  return between;
}

}  // namespace organbake
