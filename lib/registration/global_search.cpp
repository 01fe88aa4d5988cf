// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/global_search.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "registration/foreground.h"

namespace organbake {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kApart = 0.26;     // rad: poses turned by less are one
constexpr double kApartNear = 0.1;  // and near a start

// Directions spread evenly over the sphere (a golden-angle spiral).
std::vector<Vector3d> directions(int count) {
  std::vector<Vector3d> all;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * i + 1) / count, r = std::sqrt(1 - z * z);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    all.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return all;
}

// Seen from `direction` (object → camera), in some roll.
Quaterniond facing(const Vector3d& direction) {
  return Quaterniond(look_at(direction, Vector3d::Zero(), Vector3d::UnitZ()).rotation);
}

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

// The share of the photograph's variance that lamp and background explain over all that counts: R²
// at the best gain, offset and background level. What is far off costs no more than kFar, so that
// an instrument draws no pose its way. Negative when the lamp would have to darken.
double explained(const PhotoLevel& level, const Prediction& p) {
  constexpr double kFar = 0.7;  // standard deviations of the photograph
  constexpr int kRounds = 3;
  const auto row = [&](int x, int y) -> Eigen::Vector4d {  // lamp, background, 1, photograph
    const bool inside = p.contains(x, y);
    const float* phi = inside ? p.phi_at(p.index(x, y)) : nullptr;
    return {inside ? phi[0] : 0, inside ? phi[p.basis - 1] : 1, 1,
            level.luminance[level.index(x, y)]};
  };
  const auto for_pixels = [&](const auto& use) {
    for (int y = 0; y < level.intrinsics.height; ++y)
      for (int x = 0; x < level.intrinsics.width; ++x)
        if (level.valid[level.index(x, y)]) use(row(x, y));
  };
  double variance = 0, far2 = std::numeric_limits<double>::infinity(), left = 0;
  Vector3d weights = Vector3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
    for_pixels([&](const Eigen::Vector4d& r) {
      const double off = r[3] - weights.dot(r.head<3>());
      const double near = 1 / (1 + off * off / far2);  // Geman & McClure 1987
      m.selfadjointView<Eigen::Lower>().rankUpdate(r, near * near);
    });
    m = m.selfadjointView<Eigen::Lower>();
    Eigen::Matrix3d normal = m.topLeftCorner<3, 3>();
    normal.diagonal() *= 1 + 1e-9;
    weights = normal.ldlt().solve(m.topRightCorner<3, 1>());
    if (round > 0) continue;
    variance = m(3, 3) - m(2, 3) * m(2, 3) / std::max(1.0, m(2, 2));
    far2 = kFar * kFar * variance / std::max(1.0, m(2, 2));
    if (!(variance > 0)) return -1;
  }
  if (!(weights[0] > 0)) return -1;
  for_pixels([&](const Eigen::Vector4d& r) {
    left += std::min(far2, std::pow(r[3] - weights.dot(r.head<3>()), 2));
  });
  return 1 - left / variance;
}

class Candidates {
 public:
  Candidates(const RegisteredSurface& surface, const PhotoLevel& level,
             const RefineOptions& options, const RunContext& context)
      : surface_(surface), level_(level), options_(options), context_(context) {
    centered_.intrinsics = level.intrinsics;
    centered_.intrinsics.cx = level.intrinsics.width / 2.0;
    centered_.intrinsics.cy = level.intrinsics.height / 2.0;
    centered_.rays = pixel_rays(centered_.intrinsics);
  }

  std::vector<ObjectPose> from_foreground(const Foreground& seen) const {
    constexpr int kDirections = 162, kRolls = 24;
    return around(kDirections, kRolls, {seen});
  }
  std::vector<ObjectPose> from_grid() const {
    constexpr int kDirections = 60, kRolls = 12;
    const double w = level_.intrinsics.width, h = level_.intrinsics.height;
    std::vector<Foreground> supposed;
    for (const double share : {0.12, 0.3})
      for (const double x : {0.33, 0.5, 0.67})
        for (const double y : {0.33, 0.5, 0.67})
          supposed.push_back({share * w * h, Vector2d(x * w, y * h)});
    return around(kDirections, kRolls, supposed);
  }
  // Turned from a start by up to 0.5 rad about axes all round; where the start puts the organ, and
  // where it stands out when it does.
  std::vector<ObjectPose> near(const ObjectPose& start,
                               const std::optional<Foreground>& seen) const {
    constexpr int kAxes = 14;
    std::vector<Quaterniond> rotations = {start.camera_from_world};
    for (const double angle : {0.25, 0.5})
      for (const Vector3d& axis : directions(kAxes))
        rotations.push_back(Quaterniond(Eigen::AngleAxisd(angle, axis)) * start.camera_from_world);
    std::vector<ObjectPose> poses;
    for (const Quaterniond& rotation : rotations)
      poses.push_back({rotation, start.center_camera_mm});
    if (!seen) return poses;
    for (const Quaterniond& rotation : rotations) {
      const View turned = view(rotation);
      if (turned.area_px > 0) poses.push_back(placed(turned, 0, *seen));
    }
    return poses;
  }
  // Scores in the candidates' order.
  std::vector<double> scores(const std::vector<ObjectPose>& poses) const {
    std::vector<double> scores(poses.size());
    tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t i) {
      context_.throw_if_cancelled();
      scores[i] = explained(level_, picture(level_, poses[i]));
    });
    return scores;
  }

 private:
  Prediction picture(const PhotoLevel& level, const ObjectPose& pose) const {
    const ShadingBasis basis = basis_for(options_, pose);
    Prediction p;
    predict(surface_, level, pose, 1, basis, basis.first_weights(), {.smooth_outlines = false}, p);
    return p;
  }
  // A rotation, and the area and centre that its picture has at the usual distance.
  struct View {
    Quaterniond rotation;
    double area_px = 0;
    Vector2d offset = Vector2d::Zero();  // of the picture's centre from the organ's, normalised
  };
  double usual_distance() const {
    constexpr double kFill = 0.35;  // of the picture's shorter side, the organ's radius
    const Intrinsics& k = level_.intrinsics;
    return k.fx * surface_.radius_mm() / (kFill * std::min(k.width, k.height));
  }
  View view(const Quaterniond& rotation) const {
    View view{rotation};
    const Prediction p = picture(centered_, {view.rotation, {0, 0, usual_distance()}});
    for (int y = p.top; y < p.top + p.height; ++y)
      for (int x = p.left; x < p.left + p.width; ++x) {
        const float coverage = p.coverage[p.index(x, y)];
        view.area_px += coverage;
        view.offset +=
            coverage * Vector2d((x + 0.5 - centered_.intrinsics.cx) / level_.intrinsics.fx,
                                (y + 0.5 - centered_.intrinsics.cy) / level_.intrinsics.fy);
      }
    if (view.area_px > 0) view.offset /= view.area_px;
    return view;
  }
  std::vector<ObjectPose> around(int direction_count, int rolls,
                                 const std::vector<Foreground>& places) const {
    const std::vector<Vector3d> ways = directions(direction_count);
    std::vector<View> views(ways.size());
    tbb::parallel_for(std::size_t{0}, ways.size(),
                      [&](std::size_t i) { views[i] = view(facing(ways[i])); });
    std::vector<ObjectPose> poses;
    for (const View& view : views) {
      if (!(view.area_px > 0)) continue;
      for (int roll = 0; roll < rolls; ++roll)
        for (const Foreground& place : places)
          poses.push_back(placed(view, 2 * std::numbers::pi * roll / rolls, place));
    }
    return poses;
  }
  // The view turned by `roll` and moved to where its area and centre are those of `place`.
  ObjectPose placed(const View& view, double roll, const Foreground& place) const {
    const Intrinsics& k = level_.intrinsics;
    const double distance = usual_distance() * std::sqrt(view.area_px / place.area_px);
    const Vector3d ray((place.center_px.x() - k.cx) / k.fx, (place.center_px.y() - k.cy) / k.fy, 1);
    const Quaterniond turn = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), ray) *
                             Quaterniond(Eigen::AngleAxisd(roll, Vector3d::UnitZ()));
    const Vector2d offset =
        (turn * Vector3d(view.offset.x(), view.offset.y(), 0)).head<2>() * usual_distance();
    ObjectPose pose;
    pose.camera_from_world = turn * view.rotation;
    pose.center_camera_mm = distance * ray - Vector3d(offset.x(), offset.y(), 0);
    return pose;
  }

  const RegisteredSurface& surface_;
  const PhotoLevel& level_;
  PhotoLevel centered_;  // its lens and rays with the axis in the middle; no photograph
  const RefineOptions& options_;
  const RunContext& context_;
};

RefineState state_of(const ObjectPose& pose) {
  RefineState state;
  state.solver.pose = pose.to_array();
  return state;
}

// The best by score of poses that are apart, best first.
std::vector<RefineState> best_distinct(const std::vector<ObjectPose>& poses,
                                       const std::vector<double>& scores, std::size_t count,
                                       double least_angle = kApart) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return scores[a] > scores[b]; });
  std::vector<RefineState> best;
  std::vector<ObjectPose> kept;
  for (const std::size_t i : order) {
    if (best.size() == count) break;
    const bool apart = std::all_of(kept.begin(), kept.end(), [&](const ObjectPose& pose) {
      return angle_between(pose, poses[i]) > least_angle;
    });
    if (!apart || scores[i] < 0) continue;
    kept.push_back(poses[i]);
    best.push_back(state_of(poses[i]));
  }
  return best;
}

// Refines all on one level and scores them by all of the picture, so that an organ that shows less
// of itself gains nothing.
std::vector<double> refine_all(const RegisteredSurface& surface,
                               const std::vector<PhotoLevel>& pyramid, int level,
                               const RefineOptions& options, std::vector<RefineState>& states,
                               const RunContext& context) {
  std::vector<double> scores(states.size(), -1);
  tbb::parallel_for(std::size_t{0}, states.size(), [&](std::size_t i) {
    refine(surface, pyramid, level, level, options, states[i], context);
    if (!states[i].usable) return;
    const ShadingBasis basis = basis_for(options, states[i].solver.object_pose());
    Prediction p;
    predict(surface, pyramid[level], states[i].solver.object_pose(), 1, basis,
            states[i].solver.light, {}, p);
    scores[i] = explained(pyramid[level], p);
  });
  return scores;
}

std::vector<ObjectPose> poses_of(const std::vector<RefineState>& states) {
  std::vector<ObjectPose> poses;
  for (const RefineState& state : states) poses.push_back(state.solver.object_pose());
  return poses;
}

// How much less the best leaves unexplained than the best pose apart from it, as a share; nothing
// when there is no other.
std::optional<double> margin(const std::vector<RefineState>& states,
                             const std::vector<double>& scores) {
  const auto best = std::max_element(scores.begin(), scores.end()) - scores.begin();
  const ObjectPose pose = states[best].solver.object_pose();
  double second = -1;
  for (std::size_t i = 0; i < states.size(); ++i)
    if (angle_between(states[i].solver.object_pose(), pose) > kApart)
      second = std::max(second, scores[i]);
  if (second < 0) return std::nullopt;
  return 1 - (1 - scores[best]) / std::max(1e-12, 1 - second);
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
  const Candidates candidates(surface, pyramid[level], options, context);
  const auto seen = find_foreground(pyramid[level]);
  const std::vector<ObjectPose> poses =
      seen ? candidates.from_foreground(*seen) : candidates.from_grid();
  std::vector<RefineState> states = best_distinct(poses, candidates.scores(poses), 32);
  for (const std::size_t kept : {12, 4}) {
    if (states.empty()) return result;
    const std::vector<double> scores = refine_all(surface, pyramid, level, quick, states, context);
    result.runner_up_margin = margin(states, scores).value_or(result.runner_up_margin);
    states = best_distinct(poses_of(states), scores, level > 0 ? kept : 1);
    if (level == 0) break;
    --level;
  }
  if (states.empty()) return result;
  const std::vector<double> scores = refine_all(surface, pyramid, level, quick, states, context);
  result.runner_up_margin = margin(states, scores).value_or(result.runner_up_margin);
  result.best = states[std::max_element(scores.begin(), scores.end()) - scores.begin()];
  result.level = level;
  return result;
}

RefineState search_near(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                        const RigidTransform& start, const RefineOptions& options,
                        const RunContext& context) {
  constexpr double kAtHome = 0.998;  // R² that only the right place reaches
  constexpr std::size_t kTried = 6;
  const int level = static_cast<int>(pyramid.size()) - 1;
  const ObjectPose given = object_pose(start, surface.center());
  std::vector<RefineState> states = {state_of(given)};
  std::vector<double> scores = refine_all(surface, pyramid, level, options, states, context);
  if (scores[0] > kAtHome) return states[0];
  const Candidates candidates(surface, pyramid[level], options, context);
  const std::vector<ObjectPose> poses = candidates.near(given, find_foreground(pyramid[level]));
  std::vector<RefineState> others =
      best_distinct(poses, candidates.scores(poses), kTried, kApartNear);
  // On a cluttered ground a pose's score says little before it is refined.
  for (const ObjectPose& turned : turned_about_axes(given)) others.push_back(state_of(turned));
  const std::vector<double> more = refine_all(surface, pyramid, level, options, others, context);
  states.insert(states.end(), others.begin(), others.end());
  scores.insert(scores.end(), more.begin(), more.end());
  return states[std::max_element(scores.begin(), scores.end()) - scores.begin()];
}

}  // namespace organbake
