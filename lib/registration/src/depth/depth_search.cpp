// SPDX-License-Identifier: GPL-3.0-or-later
// Smooth organs have many places that fit a little: alignments from seeded starts, thinned to
// distinct ones round by round.
#include "depth/depth_search.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/median.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

struct Candidate {
  DepthState state;
  double cost = 2;
};

// By how much the surface lies farther than the depth has it, where rays through both meet it: the
// scale that a pose asks for. Nothing where none does.
std::optional<double> log_scale_at(const RegisteredSurface& surface, const SeenDepth& depth,
                                   const ObjectPose& pose) {
  constexpr std::size_t kRays = 150;
  const RigidTransform world_from_camera = rigid_transform(pose, surface.center()).inverse();
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < depth.points.size(); i += 1 + depth.points.size() / kRays)
    rays.push_back(
        {world_from_camera.translation, world_from_camera.rotation * depth.points[i].place});
  std::vector<RayHit> hits(rays.size());
  surface.scene().first_hits(rays, hits);
  std::vector<double> ratios;
  for (const RayHit& hit : hits)
    if (hit.face != kNoHit) ratios.push_back(hit.t);
  if (ratios.empty()) return std::nullopt;
  return std::log(median(std::move(ratios)));
}

// Metric depth has a bias of a percent or two; of relative depth the start says as much as it says
// of the distance.
ScalePrior prior_of(const RegisteredSurface& surface, const SeenDepth& depth,
                    const ObjectPose& start) {
  constexpr double kBias = 0.01, kStart_mm = 15, kLeast = 0.03, kMost = 0.2;
  if (!depth.relative) return {0, kBias};
  const double distance_mm = start.center_camera_mm.norm();
  return {log_scale_at(surface, depth, start).value_or(0),
          std::clamp(kStart_mm / std::max(1.0, distance_mm), kLeast, kMost)};
}

std::vector<Candidate> places_round(const RegisteredSurface& surface, const SeenDepth& depth,
                                    const ObjectPose& start, double log_scale) {
  constexpr int kPlaces = 90;
  constexpr double kFarthest_mm = 30, kLargest_rad = 0.35;
  RandomStream random(19580321);
  std::vector<Candidate> places = {{{start, log_scale}, 2}};
  for (int i = 0; i < kPlaces; ++i) {
    Motion motion;
    for (int j = 0; j < 6; ++j) motion[j] = random.normal();
    const double far = std::sqrt((i + 0.5) / kPlaces);
    motion.head<3>() *= far * kLargest_rad / motion.head<3>().norm();
    motion.tail<3>() *= far * kFarthest_mm / motion.tail<3>().norm();
    const ObjectPose pose = moved(start, motion);
    const double own =
        depth.relative ? log_scale_at(surface, depth, pose).value_or(log_scale) : log_scale;
    places.push_back({{pose, own}, 2});
  }
  return places;
}

// Where a start says nothing any more. A surface that is free to come nearer, with all that is
// seen, would cover more of it.
bool strayed(const ObjectPose& start, const ScalePrior& prior, const DepthState& state) {
  constexpr double kFarthest_mm = 45, kFarthest_rad = 0.5, kFarthest_sd = 3;
  const Motion motion = motion_between(start, state.pose);
  return motion.tail<3>().norm() > kFarthest_mm || motion.head<3>().norm() > kFarthest_rad ||
         std::abs(state.log_scale - prior.log_mean) > kFarthest_sd * prior.log_sd;
}

double apart_mm(const RegisteredSurface& surface, const DepthState& a, const DepthState& b) {
  const Motion motion = motion_between(a.pose, b.pose);
  return motion.tail<3>().norm() + motion.head<3>().norm() * surface.radius_mm() / 2;
}

// The best of those that are apart, best first.
std::vector<Candidate> best_distinct(const RegisteredSurface& surface,
                                     std::vector<Candidate> candidates, std::size_t count) {
  constexpr double kApart_mm = 3;
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  std::vector<Candidate> best;
  for (const Candidate& candidate : candidates) {
    if (best.size() == count) break;
    if (std::all_of(best.begin(), best.end(), [&](const Candidate& known) {
          return apart_mm(surface, known.state, candidate.state) > kApart_mm;
        }))
      best.push_back(candidate);
  }
  return best;
}

}  // namespace

FoundByDepth search_by_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                             const ObjectPose& start, const RunContext& context) {
  struct Round {
    AlignOptions align;
    std::size_t kept;
  };
  const std::size_t all = depth.points.size();
  // Most starts show within a few steps that they lead nowhere.
  const AlignOptions few{
      .stride = std::max<std::size_t>(1, all / 150), .iterations = 4, .last_reach = 0.05};
  const Round rounds[] = {
      {few, 30},
      {{.stride = few.stride, .iterations = 6, .first_reach = few.last_reach}, 12},
      {{.stride = std::max<std::size_t>(1, all / 400),
        .iterations = 8,
        .first_reach = 0.04,
        .last_reach = 0.015},
       4},
      {{.stride = 1, .iterations = 8, .first_reach = 0.03, .last_reach = 0.01}, 4}};
  FoundByDepth found;
  found.prior = prior_of(surface, depth, start);
  std::vector<Candidate> candidates = places_round(surface, depth, start, found.prior.log_mean);
  for (const Round& round : rounds) {
    parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
      context.throw_if_cancelled();
      candidates[i].cost =
          align_depth(surface, depth, found.prior, round.align, candidates[i].state);
      if (strayed(start, found.prior, candidates[i].state)) candidates[i].cost = 2;
    });
    candidates = best_distinct(surface, std::move(candidates), round.kept);
  }
  found.state = candidates.front().state;
  found.cost = candidates.front().cost;
  if (candidates.size() > 1)
    found.runner_up_margin = 1 - found.cost / std::max(1e-9, candidates[1].cost);
  return found;
}

}  // namespace organbake
