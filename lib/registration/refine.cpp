// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/refine.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>

#include "registration/cost_functions/pose_manifold.h"

namespace organbake {
namespace {

constexpr std::size_t kFewestPixels = 40;  // of an overlap, and of a patch
constexpr int kFinestBand = 5;             // pixels beyond the outline

using Patches = std::map<std::pair<int, int>, std::vector<WeightedPixel>>;

Patches split(const std::vector<WeightedPixel>& pixels, int side) {
  Patches patches;
  for (const WeightedPixel& p : pixels) patches[{p.y / side, p.x / side}].push_back(p);
  return patches;
}

double total_weight(const std::vector<WeightedPixel>& pixels) {
  double sum = 0;
  for (const WeightedPixel& p : pixels) sum += p.weight;
  return sum;
}

// How much the prediction varies in a patch: what it can tell of the pose.
double contrast(const LivePrediction& live, const std::vector<WeightedPixel>& pixels) {
  double sum = 0, sum_w = 0, sum2 = 0;
  for (const WeightedPixel& p : pixels) {
    const double b = live.radiance(p.x, p.y);
    sum_w += p.weight;
    sum += p.weight * b;
    sum2 += p.weight * b * b;
  }
  return sum_w > 0 ? sum2 - sum * sum / sum_w : 0;
}

class LevelProblem {
 public:
  LevelProblem(LivePrediction& live, SolverState& state, const RefineOptions& options)
      : live_(live), state_(state), options_(options), problem_(problem_options(live)) {
    problem_.AddParameterBlock(state.pose.data(), 7, &manifold_);
    problem_.AddParameterBlock(state.light.data(), live.basis().size());
    problem_.AddParameterBlock(&state.log_focal, 1);
    if (!options.free_focal) problem_.SetParameterBlockConstant(&state.log_focal);
    // Focal lengths beyond half or double are another lens.
    problem_.SetParameterLowerBound(&state.log_focal, 0, -0.7);
    problem_.SetParameterUpperBound(&state.log_focal, 0, 0.7);
  }

  bool add_whole(const std::vector<WeightedPixel>& pixels) { return add(pixels, nullptr); }
  // Each patch counts by its contrast, so that the sum is 1 − R's again when all fit.
  bool add_patches(const std::vector<WeightedPixel>& pixels) {
    bool any = false;
    const Patches patches = split(pixels, options_.patch_px);
    std::vector<double> contrasts;
    for (const auto& [cell, patch] : patches) contrasts.push_back(contrast(live_, patch));
    const double all = std::accumulate(contrasts.begin(), contrasts.end(), 0.0);
    if (!(all > 0)) return false;
    auto own = contrasts.begin();
    for (const auto& [cell, patch] : patches) {
      const double share = *own++ / all;
      if (total_weight(patch) < kFewestPixels) continue;
      if (!(share > 0)) continue;
      // On s = 2 (1 − R_k): R_k below about 0.7 counts less and less.
      any |= add(patch,
                 new ceres::ScaledLoss(new ceres::CauchyLoss(0.75), share, ceres::TAKE_OWNERSHIP));
    }
    return any;
  }
  // A step that gains less than noise alone does to 1 − R is not worth another drawing.
  void solve(int iterations, std::size_t pixels) {
    ceres::Solver::Options options;
    options.max_num_iterations = iterations;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.num_threads = 1;  // threads are in the prediction: repeatable sums
    options.logging_type = ceres::SILENT;
    options.function_tolerance = 0.5 / static_cast<double>(pixels);
    options.gradient_tolerance = 1e-14;
    options.initial_trust_region_radius = 1e3;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
  }

 private:
  static ceres::Problem::Options problem_options(LivePrediction& live) {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.evaluation_callback = &live;
    return options;
  }
  bool add(const std::vector<WeightedPixel>& pixels, ceres::LossFunction* loss) {
    auto cost = std::make_unique<NccCost>(live_, pixels, options_.similarity);
    if (!cost->usable()) {
      delete loss;
      return false;
    }
    problem_.AddResidualBlock(cost.release(), loss, state_.pose.data(), state_.light.data(),
                              &state_.log_focal);
    return true;
  }

  LivePrediction& live_;
  SolverState& state_;
  const RefineOptions& options_;
  PoseManifold manifold_;
  ceres::Problem problem_;
};

bool in_front(const RegisteredSurface& surface, const ObjectPose& pose) {
  return pose.center_camera_mm.allFinite() && pose.camera_from_world.coeffs().allFinite() &&
         pose.center_camera_mm.z() > 0.05 * surface.radius_mm();
}

}  // namespace

ShadingBasis basis_for(const RefineOptions& options, const ObjectPose& pose) {
  return ShadingBasis(options.light, pose.center_camera_mm.norm());
}

namespace {

void refine_on_level(const RegisteredSurface& surface, const PhotoLevel& level, int band,
                     const RefineOptions& options, RefineState& state, const RunContext& context) {
  const double settled = 0.2;  // pixels: less motion is none
  // The finest level's drawings are the dearest, and its start is the best.
  const bool finest = level.factor == 1;
  const int rounds = finest ? std::min(1, options.outer_iterations) : options.outer_iterations;
  const int steps = finest ? std::min(3, options.solver_iterations) : options.solver_iterations;
  for (int outer = 0; outer < rounds; ++outer) {
    context.throw_if_cancelled();
    if (!in_front(surface, state.solver.object_pose())) {
      state.usable = false;
      return;
    }
    const ShadingBasis basis = basis_for(options, state.solver.object_pose());
    if (outer == 0 && !state.usable) state.solver.light = basis.first_weights();
    LivePrediction live(surface, level, basis, {.margin = band + 2}, state.solver);
    live.PrepareForEvaluation(false, true);
    std::vector<WeightedPixel> pixels = overlap(level, live.prediction(), band);
    state.usable = pixels.size() >= kFewestPixels;
    if (!state.usable) return;
    state.appearance = fit_appearance(level, live.prediction(), basis, pixels);
    state.solver.light = state.appearance.light;
    live.PrepareForEvaluation(false, true);

    const SolverState before = state.solver;
    LevelProblem problem(live, state.solver, options);
    const bool whole = options.form == Form::whole || level.factor > 2;
    state.usable = whole ? problem.add_whole(pixels) : problem.add_patches(pixels);
    if (!state.usable) return;
    problem.solve(steps, pixels.size());
    const bool done =
        outer + 1 == rounds || pixels_moved(level, surface, before, state.solver) < settled;
    if (!done) continue;
    live.PrepareForEvaluation(false, true);
    state.correlation = NccCost(live, pixels, options.similarity).correlation();
    break;
  }
}

}  // namespace

void refine(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid, int first,
            int last, const RefineOptions& options, RefineState& state, const RunContext& context) {
  for (int i = first; i >= last; --i) {
    // A coarse level looks farther beyond the outline: up to a third of the organ's radius.
    const PhotoLevel& level = pyramid[i];
    const double radius_px =
        level.intrinsics.fx * surface.radius_mm() / std::max(1e-9, state.solver.pose[6]);
    const int band =
        i == 0 ? kFinestBand : std::clamp(static_cast<int>(radius_px / 3), kFinestBand, 8);
    refine_on_level(surface, level, band, options, state, context);
    if (!state.usable) return;
  }
}

Curvature curvature(const RegisteredSurface& surface, const PhotoLevel& level,
                    const RefineOptions& options, const RefineState& state) {
  Curvature result;
  const ShadingBasis basis = basis_for(options, state.solver.object_pose());
  LivePrediction live(surface, level, basis, {.margin = kFinestBand + 2}, state.solver);
  live.PrepareForEvaluation(true, true);
  std::vector<WeightedPixel> pixels = overlap(level, live.prediction(), kFinestBand);
  if (pixels.size() < kFewestPixels) return result;
  fit_appearance(level, live.prediction(), basis, pixels);
  const int motion = options.free_focal ? 7 : 6, light = basis.size(), all = motion + light;
  const NccCost::Rows rows = NccCost(live, pixels, Similarity::radiance).rows();
  const Eigen::VectorXd& r = rows.residual;
  NccBlock::RowMajor j(r.size(), all);
  j << rows.derivative.leftCols(motion), rows.derivative.rightCols(light);

  // Marginalised: the motion's columns less what the light's explain of them.
  Eigen::MatrixXd normal = j.transpose() * j;
  Eigen::MatrixXd ll = normal.bottomRightCorner(light, light);
  ll.diagonal().array() += 1e-9 * ll.diagonal().maxCoeff() + 1e-300;
  const Eigen::MatrixXd explained = ll.ldlt().solve(normal.bottomLeftCorner(light, motion));
  result.information =
      normal.topLeftCorner(motion, motion) - normal.topRightCorner(motion, light) * explained;
  const NccBlock::RowMajor own = j.leftCols(motion) - j.rightCols(light) * explained;
  std::map<std::pair<int, int>, Eigen::VectorXd> slopes;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    auto& slope = slopes[{pixels[i].y / options.patch_px, pixels[i].x / options.patch_px}];
    if (slope.size() == 0) slope = Eigen::VectorXd::Zero(motion);
    slope += r[static_cast<Eigen::Index>(i)] * own.row(static_cast<Eigen::Index>(i)).transpose();
  }
  for (const auto& [cell, slope] : slopes) result.patch_slopes.push_back(slope);
  result.pixels = pixels.size();
  return result;
}

}  // namespace organbake
