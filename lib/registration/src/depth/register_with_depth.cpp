// SPDX-License-Identifier: GPL-3.0-or-later
// The pose by photograph and depth together. A photograph tells an organ's place across the view
// well and its distance badly, its depth the other way round. Both are composite likelihoods, whose
// neighbouring parts err alike; so that they can be added, each is multiplied by what its own
// scatter says that it is worth (Pauli, Racugno & Ventura 2011), and the covariance is the sandwich
// of both.
#include <algorithm>
#include <cmath>

#include "cost_functions/cost_functions.h"
#include "depth/depth_alignment.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/geometry/dense_solve.h"
#include "organbake/registration/register_photo.h"
#include "pose/poses.h"

namespace organbake {
namespace {

// What is asked of a pose that depth took part in. The surface is seen where the depth lies on it;
// where something lies before it, that says nothing; where the depth lies beyond it, the surface
// cannot be there.

using Eigen::Vector3d;

// Bounds of the verdict, set on seeded patches with the faults of real depth, and on other organs'
// depth, so that no wrong one passes (tests/acceptance, RegistrationDepth).
constexpr double kDepthAgrees = 0.025;  // of the distance

constexpr double kDepthLeastShare = 0.35, kDepthSureShare = 0.6;
constexpr double kDepthMostPierced = 0.25, kDepthSurePierced = 0.1;
constexpr double kDepthLargestNoise = 0.0125, kDepthLargestSurfaceSd_mm = 1.0;
constexpr double kDepthLeastMargin = 0.06;
constexpr double kDepthLeastVisible = 0.1, kDepthSureVisible = 0.25;
// Of the scale that is asked for, off 1, with its deviation: depth's own bias is up to 2 %.
constexpr double kDepthMostOffSize = 0.035;

// What is wrong with the surface's size against the depth's.
std::string told_of_size(const DepthFit& d) {
  if (std::abs(std::log(d.free_scale)) <= d.scale_sd)
    return "the depth tells the surface's size only to " + percent(d.scale_sd, 1);
  return "the surface is " + percent(std::abs(d.free_scale - 1), 1) +
         (d.free_scale > 1 ? " larger" : " smaller") + " (± " + percent(d.scale_sd, 1) +
         ") than the depth has it: is it this organ's, and are both in mm?";
}

// How the depth lies to the surface at a pose.
DepthFit depth_fit(const RegisteredSurface& surface, const SeenDepth& depth,
                   const DepthState& state) {
  const RigidTransform world_from_camera = rigid_transform(state.pose, surface.center()).inverse();
  DepthFit fit;
  fit.scale = std::exp(state.log_scale);
  // Rays as long as to what is seen: where the surface lies on it they meet it at t = 1.
  std::vector<Ray> rays;
  for (const SeenDepth::Point& point : depth.points) {
    Ray ray;
    ray.origin = world_from_camera.translation;
    ray.direction = world_from_camera.rotation * (fit.scale * point.place);
    rays.push_back(ray);
  }
  std::vector<RayHit> hits(rays.size());
  surface.scene().first_hits(rays, hits);
  double covered = 0, agreeing = 0, pierced = 0;
  std::vector<double> off_mm;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].face == kNoHit) continue;
    ++covered;
    const double farther = hits[i].t - 1;  // the surface than what is seen, share
    pierced += farther < -kDepthAgrees;
    if (std::abs(farther) > kDepthAgrees) continue;
    ++agreeing;
    const Vector3d normal = surface.skin(hits[i], rays[i].direction).normal;
    off_mm.push_back(std::abs(farther * rays[i].direction.dot(normal)));
  }
  fit.share = agreeing / std::max(1.0, covered);
  fit.pierced_share = pierced / std::max(1.0, covered);
  fit.noise_mm = kSigmaOfMedianDeviation * median(std::move(off_mm));
  fit.noise_share = fit.noise_mm / std::max(1e-9, state.pose.center_camera_mm.z());
  return fit;
}

// The verdict of a pose that depth took part in, by `quality.depth`, the standard deviations and
// what of the surface is in view.
void judge_with_depth(PoseQuality& q) {
  const DepthFit& d = *q.depth;
  const VerdictRule rules[] = {
      {!(q.visible_share >= kDepthLeastVisible), Verdict::failed,
       "only " + percent(q.visible_share) + " of the facing surface is in the picture, " +
           percent(kDepthLeastVisible) + " are needed"},
      {!(d.share >= kDepthLeastShare), Verdict::failed,
       "the depth lies elsewhere than the surface: " + percent(d.share) + " of it fits"},
      {!(d.pierced_share <= kDepthMostPierced), Verdict::failed,
       "the surface would stand before what is seen in " + percent(d.pierced_share) +
           " of where it lies"},
      {!(q.visible_share >= kDepthSureVisible), Verdict::doubtful,
       "only " + percent(q.visible_share) + " of the facing surface is in the picture, " +
           percent(kDepthSureVisible) + " are sure"},
      {!(d.share >= kDepthSureShare), Verdict::doubtful,
       "only " + percent(d.share) + " of the surface in view lies where the depth is, " +
           percent(kDepthSureShare) + " should"},
      {!(d.pierced_share <= kDepthSurePierced), Verdict::doubtful,
       "the surface would stand before what is seen in " + percent(d.pierced_share) +
           " of where it lies"},
      {!(d.noise_share <= kDepthLargestNoise), Verdict::doubtful,
       "the depth lies " + to_text(d.noise_mm, 1) + " mm off the surface: is it this organ's?"},
      {!(d.runner_up_margin >= kDepthLeastMargin), Verdict::doubtful,
       "another pose fits the depth almost as well"},
      {!(std::abs(std::log(d.free_scale)) + d.scale_sd <= kDepthMostOffSize) && !d.relative,
       Verdict::doubtful, told_of_size(d)},
      {!(q.surface_sd_mm <= kDepthLargestSurfaceSd_mm), Verdict::doubtful,
       "the pose is uncertain by " + to_text(q.surface_sd_mm, 2) + " mm on the surface"},
  };
  judge_by(rules, q);
}

using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr int kFinestDepthSide = 640, kCoarsestDepthSide = 160;  // pixels: depth is no finer

DepthState depth_state(const RefineState& state) {
  return {state.solver.object_pose(), state.solver.log_depth_scale};
}

CompositeEvidence photo_evidence(const Curvature& curvature) {
  CompositeEvidence evidence{curvature.information, Eigen::MatrixXd::Zero(6, 6)};
  for (const Eigen::VectorXd& slope : curvature.patch_slopes)
    evidence.variability += slope * slope.transpose();
  return evidence;
}

class JointPose {
 public:
  JointPose(const RegisteredSurface& surface, const SeenDepth& depth, const ScalePrior& prior)
      : surface_(surface), depth_(depth), prior_(prior) {}

  void refine_on(const std::vector<PhotoLevel>& pyramid, int level, RefineOptions options,
                 RefineState& state, const RunContext& context) {
    const RefineOptions plain = options;
    options.add_terms = [&](const RefineState& at, LevelProblem& problem) {
      const double photo = photo_magnitude(curvature(surface_, pyramid[level], plain, at));
      weighed_ = weigh_depth(surface_, depth_, depth_state(at));
      problem.add_depth(
          std::make_unique<DepthCost>(depth_, weighed_, prior_, surface_.center(), 1 / photo));
    };
    refine(surface_, pyramid, level, level, options, state, context);
  }

  // Of the pose's motion (6) and the logarithm of the scale.
  Matrix7 covariance(const PhotoLevel& level, const RefineOptions& options,
                     const RefineState& state) const {
    const WeighedDepth weighed = weigh_depth(surface_, depth_, depth_state(state));
    const double expected = 1 / (prior_.log_sd * prior_.log_sd);
    Matrix7 information = weighed.trust * weighed.evidence.information;
    Matrix7 variability = weighed.trust * weighed.trust * weighed.evidence.variability;
    information(6, 6) += expected;
    variability(6, 6) += expected;
    const Curvature seen = curvature(surface_, level, options, state);
    if (seen.pixels > 0) {
      const CompositeEvidence evidence = photo_evidence(seen);
      const double photo = photo_magnitude(seen);
      information.topLeftCorner<6, 6>() += photo * evidence.information;
      variability.topLeftCorner<6, 6>() += photo * photo * evidence.variability;
    }
    // The sandwich: how the evidence scatters, between what it is taken to say.
    const Matrix7 inverse = solve_symmetric(information, Matrix7::Identity());
    return inverse * variability * inverse;
  }

 private:
  // Where the photograph tells nothing, next to nothing.
  static double photo_magnitude(const Curvature& curvature) {
    constexpr double kLeast = 1e-3;
    if (curvature.pixels == 0) return kLeast;
    const double magnitude = photo_evidence(curvature).magnitude();
    return magnitude > kLeast ? magnitude : kLeast;
  }

  const RegisteredSurface& surface_;
  const SeenDepth& depth_;
  const ScalePrior& prior_;
  WeighedDepth weighed_;
};

// What is near a scope's lens is lit by it; what is seen whole may be lit by anything.
LightModel choose_light(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                        const RefineState& state, RefineOptions options,
                        const RunContext& context) {
  if (surface.open()) return LightModel::beam;
  std::vector<LightTrial> starts;
  for (const LightModel model : {LightModel::camera, LightModel::beam, LightModel::estimated})
    starts.push_back({model, state});
  const int coarsest = static_cast<int>(pyramid.size()) - 1;
  return simplest_of_best(
             try_lights(surface, pyramid, coarsest, coarsest, options, starts, context))
      .model;
}

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
    // Of relative depth each place has a scale of its own, which its distance decides.
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

bool are_apart(const RegisteredSurface& surface, const Candidate& a, const Candidate& b) {
  constexpr double kApart_mm = 3;
  const Motion motion = motion_between(a.state.pose, b.state.pose);
  return motion.tail<3>().norm() + motion.head<3>().norm() * surface.radius_mm() / 2 > kApart_mm;
}

// The scale that surface, depth and photograph ask for when nothing is expected of it, and its
// standard deviation. A surface of another size than the organ's finds a place where metric depth
// lies on it about as well; that it would rather have all lengths changed gives it away.
void measure_scale(const RegisteredSurface& surface, const SeenDepth& depth,
                   const std::vector<PhotoLevel>& pyramid, const RefineOptions& options,
                   RefineState state, DepthFit& fit, const RunContext& context) {
  constexpr double kAnything = 0.5;  // of the scale's logarithm
  const ScalePrior open{state.solver.log_depth_scale, kAnything};
  DepthState at = depth_state(state);
  align_depth(surface, depth, open, {.iterations = 12, .first_reach = 0.03, .last_reach = 0.01},
              at);
  if (in_front(surface, at.pose)) {
    state.solver.pose = at.pose.to_array();
    state.solver.log_depth_scale = at.log_scale;
  }
  const int level = std::min(1, static_cast<int>(pyramid.size()) - 1);
  JointPose joint(surface, depth, open);
  joint.refine_on(pyramid, level, options, state, context);
  if (!state.usable) return;
  fit.free_scale = std::exp(state.solver.log_depth_scale);
  fit.scale_sd = std::sqrt(std::max(0.0, joint.covariance(pyramid[level], options, state)(6, 6)));
}

}  // namespace

RegisteredPhoto register_with_depth(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                    const RigidTransform& start, const RegistrationOptions& o,
                                    const RunContext& context) {
  RegisteredPhoto result;
  result.camera = {"", photo.intrinsics, start};
  const FoundByDepth found =
      search_by_depth(surface, photo.depth, object_pose(start, surface.center()), context);
  context.progress(0.5);
  const std::vector<PhotoLevel> pyramid =
      photo_pyramid(photo.image, photo.mask, photo.intrinsics,
                    std::min(o.finest_side_px, kFinestDepthSide), kCoarsestDepthSide);
  RefineState state;
  state.solver.pose = found.state.pose.to_array();
  state.solver.log_depth_scale = found.state.log_scale;
  if (pyramid.empty() || !in_front(surface, found.state.pose)) {
    result.quality.reason = "the depth shows nothing like the surface near the start";
    return result;
  }
  RefineOptions options;
  options.light = o.light;
  options.check_focal = false;
  if (o.light == LightModel::automatic)
    options.light = choose_light(surface, pyramid, state, options, context);
  result.light = options.light;
  JointPose joint(surface, photo.depth, found.prior);
  for (int level = std::min(1, static_cast<int>(pyramid.size()) - 1); level >= 0; --level)
    joint.refine_on(pyramid, level, options, state, context);
  context.progress(0.9);
  result.quality = assess(surface, pyramid, options, state, 1, context);
  if (!state.usable) return result;
  const Matrix7 covariance = joint.covariance(pyramid.front(), options, state);
  measure_spread(surface, Eigen::Matrix<double, 6, 6>(covariance.topLeftCorner<6, 6>()),
                 state.solver.object_pose(), result.quality);
  result.quality.depth = depth_fit(surface, photo.depth, depth_state(state));
  result.quality.depth->runner_up_margin = found.runner_up_margin;
  result.quality.depth->scale_sd = std::sqrt(std::max(0.0, covariance(6, 6)));
  result.quality.depth->free_scale = result.quality.depth->scale;
  result.quality.depth->relative = photo.depth.relative;
  if (!photo.depth.relative)
    measure_scale(surface, photo.depth, pyramid, options, state, *result.quality.depth, context);
  judge_with_depth(result.quality);
  result.camera.camera_from_world = rigid_transform(state.solver.object_pose(), surface.center());
  return result;
}

// Smooth organs have many places that fit a little: alignments from seeded starts, thinned to
// distinct ones round by round.

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
    candidates = best_apart(
        std::move(candidates), round.kept, [](const Candidate& one) { return one.cost; },
        [&](const Candidate& a, const Candidate& b) { return are_apart(surface, a, b); });
  }
  found.state = candidates.front().state;
  found.cost = candidates.front().cost;
  if (candidates.size() > 1)
    found.runner_up_margin = 1 - found.cost / std::max(1e-9, candidates[1].cost);
  return found;
}

}  // namespace organbake
