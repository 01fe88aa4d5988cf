// SPDX-License-Identifier: GPL-3.0-or-later
// Poses without a start: candidates are scored, thinned to distinct ones and refined level by
// level. The runner-up's margin tells how unique the answer is.
#include "pose/poses.h"

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr double kApart = 0.26;     // rad: poses turned by less are one
constexpr double kApartNear = 0.1;  // and near a start

// A little to either side of each axis.
std::vector<ObjectPose> turned_about_axes(const ObjectPose& pose) {
  constexpr double kTurn = 0.2;  // rad
  std::vector<ObjectPose> turned;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      turned.push_back(moved(pose, sign * kTurn * Motion::Unit(axis)));
  return turned;
}

double angle_between(const ObjectPose& a, const ObjectPose& b) {
  return a.camera_from_world.angularDistance(b.camera_from_world);
}

RefineState state_of(const ObjectPose& pose) {
  RefineState state;
  state.solver.pose = pose.to_array();
  return state;
}

// The best by score of poses that are apart, best first.
std::vector<RefineState> best_distinct(const std::vector<ObjectPose>& poses,
                                       const std::vector<double>& scores, std::size_t count,
                                       double least_angle = kApart) {
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (scores[i] >= 0) usable.push_back(i);
  const auto apart = [&](std::size_t a, std::size_t b) {
    return angle_between(poses[a], poses[b]) > least_angle;
  };
  std::vector<RefineState> best;
  for (const std::size_t i : best_apart(
           usable, count, [&](std::size_t i) { return -scores[i]; }, apart))
    best.push_back(state_of(poses[i]));
  return best;
}

// Refines all on one level and scores them by all of the picture, so that an organ that shows less
// of itself gains nothing.
std::vector<double> refine_all(const RegisteredSurface& surface,
                               const std::vector<PhotoLevel>& pyramid, int level,
                               const RefineOptions& options, ScoredBy by,
                               std::vector<RefineState>& states, const RunContext& context) {
  std::vector<double> scores(states.size(), -1);
  parallel_for(std::size_t{0}, states.size(), [&](std::size_t i) {
    refine(surface, pyramid, level, level, options, states[i], context);
    if (!states[i].usable) return;
    const ShadingBasis basis = basis_for(options, states[i].solver.object_pose());
    Prediction p;
    predict(surface, pyramid[level], states[i].solver.object_pose(), 1, basis,
            states[i].solver.light, {}, p);
    scores[i] = explained(pyramid[level], p, by);
  });
  return scores;
}

std::vector<ObjectPose> poses_of(const std::vector<RefineState>& states) {
  std::vector<ObjectPose> poses;
  for (const RefineState& state : states) poses.push_back(state.solver.object_pose());
  return poses;
}

// How well each fits: 1 less what it leaves unexplained of all the picture, times what it leaves of
// the overlap. The picture alone is misled by a cluttered ground, of which a wrong organ may
// explain a little; the overlap alone by an organ that shows less of itself. Unusable: below 0.
std::vector<double> fits(const std::vector<RefineState>& states,
                         const std::vector<double>& scores) {
  std::vector<double> fits(states.size(), -1);
  for (std::size_t i = 0; i < states.size(); ++i)
    if (scores[i] >= 0) fits[i] = 1 - (1 - scores[i]) * (1 - states[i].correlation);
  return fits;
}

std::size_t best_fit(const std::vector<RefineState>& states, const std::vector<double>& scores) {
  const std::vector<double> fit = fits(states, scores);
  return static_cast<std::size_t>(std::max_element(fit.begin(), fit.end()) - fit.begin());
}

// How much less the best fit leaves unexplained than the best pose apart from it, as a share;
// nothing when there is no other.
std::optional<double> margin(const std::vector<RefineState>& states,
                             const std::vector<double>& scores) {
  const std::vector<double> fit = fits(states, scores);
  const std::size_t best = best_fit(states, scores);
  const ObjectPose pose = states[best].solver.object_pose();
  double second = -1;
  for (std::size_t i = 0; i < states.size(); ++i)
    if (angle_between(states[i].solver.object_pose(), pose) > kApart)
      second = std::max(second, fit[i]);
  if (second < 0) return std::nullopt;
  return std::max(0.0, 1 - (1 - fit[best]) / std::max(1e-12, 1 - second));
}

}  // namespace

SearchResult search_all_round(const RegisteredSurface& surface,
                              const std::vector<PhotoLevel>& pyramid, const RefineOptions& options,
                              const RunContext& context) {
  SearchResult result;
  RefineOptions quick = options;  // to tell candidates apart
  quick.outer_iterations = std::min(2, options.outer_iterations);
  quick.solver_iterations = std::min(6, options.solver_iterations);
  int level = static_cast<int>(pyramid.size()) - 1;
  const PoseCandidates candidates(surface, pyramid[level], options, context);
  const std::vector<ObjectPose> poses = candidates.all_round();
  std::vector<RefineState> states =
      best_distinct(poses, candidates.scores(poses, ScoredBy::whole_basis), 32);
  // Fewer and fewer on finer and finer levels, each of which costs four times as much as the last.
  for (const std::size_t kept : {12, 4}) {
    if (states.empty()) return result;
    const std::vector<double> scores =
        refine_all(surface, pyramid, level, quick, ScoredBy::whole_basis, states, context);
    result.runner_up_margin = margin(states, scores).value_or(result.runner_up_margin);
    states = best_distinct(poses_of(states), fits(states, scores), level > 0 ? kept : 1);
    if (level == 0) break;
    --level;
  }
  if (states.empty()) return result;
  const std::vector<double> scores =
      refine_all(surface, pyramid, level, quick, ScoredBy::whole_basis, states, context);
  result.runner_up_margin = margin(states, scores).value_or(result.runner_up_margin);
  result.best = states[best_fit(states, scores)];
  result.level = level;
  return result;
}

SearchResult search_here(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                         const RigidTransform& start, const RefineOptions& options,
                         const RunContext& context) {
  SearchResult result;
  result.level = static_cast<int>(pyramid.size()) - 1;
  result.best = state_of(object_pose(start, surface.center()));
  refine(surface, pyramid, result.level, result.level, options, result.best, context);
  return result;
}

SearchResult search_near(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                         const RigidTransform& start, const RefineOptions& options,
                         const RunContext& context) {
  constexpr double kAtHome = 0.998;  // R² that only the right place reaches
  constexpr std::size_t kTried = 6;
  SearchResult result;
  result.level = static_cast<int>(pyramid.size()) - 1;
  const ObjectPose given = object_pose(start, surface.center());
  std::vector<RefineState> states = {state_of(given)};
  std::vector<double> scores =
      refine_all(surface, pyramid, result.level, options, ScoredBy::lamp, states, context);
  result.best = states[0];
  // So well that no other place could explain it better: none has to be tried.
  if (scores[0] > kAtHome) return result;
  const PoseCandidates candidates(surface, pyramid[result.level], options, context);
  const std::vector<ObjectPose> poses = candidates.near(given);
  std::vector<RefineState> others =
      best_distinct(poses, candidates.scores(poses, ScoredBy::lamp), kTried, kApartNear);
  // On a cluttered ground a pose's score says little before it is refined.
  for (const ObjectPose& turned : turned_about_axes(given)) others.push_back(state_of(turned));
  const std::vector<double> more =
      refine_all(surface, pyramid, result.level, options, ScoredBy::lamp, others, context);
  states.insert(states.end(), others.begin(), others.end());
  scores.insert(scores.end(), more.begin(), more.end());
  result.best = states[best_fit(states, scores)];
  return result;
}

}  // namespace organbake
