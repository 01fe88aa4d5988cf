// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/path_alignment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace organbake {
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
