// SPDX-License-Identifier: GPL-3.0-or-later
// A photograph tells an organ's place across the view well and its distance badly, its depth the
// other way round. Both are composite likelihoods, whose neighbouring parts err alike; so that they
// can be added, each is multiplied by what its own scatter says that it is worth (Pauli, Racugno &
// Ventura 2011), and the covariance is the sandwich of both.
#include "depth/register_with_depth.h"

#include <algorithm>
#include <cmath>

#include "appearance/light_choice.h"
#include "cost_functions/depth_cost.h"
#include "cost_functions/level_problem.h"
#include "depth/depth_search.h"
#include "depth/depth_verdict.h"
#include "depth/weighed_depth.h"
#include "organbake/geometry/dense_solve.h"
#include "pose/pose_quality.h"

namespace organbake {
namespace {

using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr int kFinestSide = 640, kCoarsestSide = 160;  // pixels: depth is no finer

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

  // Of the pose's motion, the scale's part in it included.
  Eigen::Matrix<double, 6, 6> covariance(const PhotoLevel& level, const RefineOptions& options,
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
    const Matrix7 inverse = solve_symmetric(information, Matrix7::Identity());
    return (inverse * variability * inverse).topLeftCorner<6, 6>();
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
                    std::min(o.finest_side_px, kFinestSide), kCoarsestSide);
  RefineState state;
  state.solver.pose = found.state.pose.to_array();
  state.solver.log_depth_scale = found.state.log_scale;
  if (pyramid.empty() || !in_front(surface, found.state.pose)) {
    result.quality.reason = "the depth shows nothing like the surface near the start";
    return result;
  }
  RefineOptions options;
  options.light = {o.light, o.light_direction};
  options.similarity = o.similarity;
  options.window = o.window;
  options.check_focal = false;
  options.outer_iterations = o.outer_iterations;
  options.solver_iterations = o.solver_iterations;
  if (o.light == LightModel::automatic)
    options.light.model = choose_light(surface, pyramid, state, options, context);
  result.light = options.light.model;
  JointPose joint(surface, photo.depth, found.prior);
  for (int level = std::min(1, static_cast<int>(pyramid.size()) - 1); level >= 0; --level)
    joint.refine_on(pyramid, level, options, state, context);
  context.progress(0.9);
  result.quality = assess(surface, pyramid, options, state, 1, context);
  if (!state.usable) return result;
  measure_spread(surface, joint.covariance(pyramid.front(), options, state),
                 state.solver.object_pose(), result.quality);
  result.quality.depth = depth_fit(surface, photo.depth, depth_state(state));
  result.quality.depth->runner_up_margin = found.runner_up_margin;
  judge_with_depth(result.quality);
  result.camera.camera_from_world = rigid_transform(state.solver.object_pose(), surface.center());
  return result;
}

}  // namespace organbake
