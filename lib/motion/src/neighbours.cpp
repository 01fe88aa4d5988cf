// SPDX-License-Identifier: GPL-3.0-or-later
#include "neighbours.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

struct Candidate {
  std::size_t index = 0;
  double score = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

struct Overlap {
  double share = 0, angle_rad = 0;
};

Overlap overlap_of(const PosedCamera& reference, const PosedCamera& other, double depth) {
  constexpr int kGrid = 7;
  const Intrinsics& lens = reference.intrinsics;
  const RigidTransform world = reference.camera_from_world.inverse();
  const Eigen::Vector3d there = other.center_world_mm();
  int seen = 0;
  Overlap overlap;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const Eigen::Vector2d pixel((i % kGrid + 0.5) / kGrid * lens.width,
                                (i / kGrid + 0.5) / kGrid * lens.height);
    const Eigen::Vector3d point = world * Eigen::Vector3d(unproject(lens, pixel) * depth);
    if ((other.camera_from_world * point).z() <= 0) continue;
    const Eigen::Vector2d at = project(other, point);
    if (!(at.x() > 0 && at.y() > 0 && at.x() < other.intrinsics.width &&
          at.y() < other.intrinsics.height))
      continue;
    ++seen;
    const Eigen::Vector3d a = world.translation - point, b = there - point;
    overlap.angle_rad += std::atan2(a.cross(b).norm(), a.dot(b));
  }
  overlap.angle_rad /= std::max(1, seen);
  overlap.share = seen / double(kGrid * kGrid);
  return overlap;
}

// Rises to the best angle and falls slowly beyond it.
double worth(double angle_rad, double best_rad) {
  const double x = angle_rad / best_rad;
  return x < 1 ? x : 1 / x;
}

double nearness(std::size_t i, std::size_t reference, double usual_gap) {
  const double gap = (double(i) - double(reference)) / usual_gap;
  return 1 / (1 + gap * gap);
}

}  // namespace

std::vector<std::size_t> best_neighbours(const std::vector<PosedCamera>& cameras,
                                         std::size_t reference, double depth,
                                         const NeighbourOptions& options) {
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (i == reference) continue;
    const Overlap overlap = overlap_of(cameras[reference], cameras[i], depth);
    if (overlap.share < options.least_overlap || overlap.angle_rad < options.least_angle_rad ||
        overlap.angle_rad > options.most_angle_rad)
      continue;
    double score = overlap.share * worth(overlap.angle_rad, options.best_angle_rad);
    if (options.usual_gap > 0) score *= nearness(i, reference, options.usual_gap);
    candidates.push_back({i, score, cameras[i].center_world_mm()});
  }
  std::vector<std::size_t> chosen;
  std::vector<Eigen::Vector3d> centers = {cameras[reference].center_world_mm()};
  while (static_cast<int>(chosen.size()) < options.most && !candidates.empty()) {
    // One beside another that is chosen tells little anew.
    const auto gain = [&](const Candidate& candidate) {
      double apart = depth * options.best_angle_rad;
      for (std::size_t i = 1; i < centers.size(); ++i)
        apart = std::min(apart, (candidate.center - centers[i]).norm());
      constexpr double kAlone = 0.25;
      return candidate.score * (kAlone + apart / (depth * options.best_angle_rad));
    };
    const auto best =
        std::max_element(candidates.begin(), candidates.end(),
                         [&](const Candidate& a, const Candidate& b) { return gain(a) < gain(b); });
    chosen.push_back(best->index);
    centers.push_back(best->center);
    candidates.erase(best);
  }
  return chosen;
}

}  // namespace organbake
