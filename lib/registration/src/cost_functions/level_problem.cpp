// SPDX-License-Identifier: GPL-3.0-or-later
// One level's problem for Ceres: patches of the overlap, each with a robust loss of its own, so
// that an instrument or a vignette costs the patches that it covers and no more.
#include "cost_functions/cost_functions.h"

#include <ceres/ceres.h>

#include <map>
#include <numeric>

namespace organbake {
namespace {

using Patches = std::map<std::pair<int, int>, std::vector<WeightedPixel>>;

Patches split(const std::vector<WeightedPixel>& pixels, int side) {
  Patches patches;
  for (const WeightedPixel& p : pixels) patches[{p.y / side, p.x / side}].push_back(p);
  return patches;
}

// weight × (light − fitted). Ceres 2.2's NormalPrior would free a vector of ours: Eigen aligns it
// otherwise in code for AVX than in Debian's library.
class LightPrior : public ceres::CostFunction {
 public:
  LightPrior(double weight, const Eigen::VectorXd& fitted) : weight_(weight), fitted_(fitted) {
    set_num_residuals(static_cast<int>(fitted.size()));
    mutable_parameter_block_sizes()->push_back(num_residuals());
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index n = fitted_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        weight_ * (Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - fitted_);
    if (jacobians && jacobians[0])
      Eigen::Map<Square>(jacobians[0], n, n) = weight_ * Square::Identity(n, n);
    return true;
  }

 private:
  double weight_;
  Eigen::VectorXd fitted_;
};

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

// Ends a solve where its drawing has settled.
class SettledStop : public ceres::IterationCallback {
 public:
  explicit SettledStop(const LivePrediction& live) : live_(live) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return live_.settled() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const LivePrediction& live_;
};

ceres::Problem::Options problem_options(LivePrediction& live) {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.evaluation_callback = &live;
  return options;
}

}  // namespace

LevelProblem::LevelProblem(LivePrediction& live, SolverState& state, bool free_focal)
    : live_(live), state_(state), problem_(problem_options(live)) {
  problem_.AddParameterBlock(state.pose.data(), 7, &manifold_);
  problem_.AddParameterBlock(state.light.data(), live.basis().size());
  problem_.AddParameterBlock(&state.log_focal, 1);
  if (!free_focal) problem_.SetParameterBlockConstant(&state.log_focal);
}

bool LevelProblem::add_patches(const std::vector<WeightedPixel>& pixels, int side,
                               double least_weight) {
  bool any = false;
  split_ = true;
  const Patches patches = split(pixels, side);
  std::vector<double> contrasts;
  for (const auto& [cell, patch] : patches) contrasts.push_back(contrast(live_, patch));
  const double all = std::accumulate(contrasts.begin(), contrasts.end(), 0.0);
  if (!(all > 0)) return false;
  auto own = contrasts.begin();
  for (const auto& [cell, patch] : patches) {
    const double share = *own++ / all;
    if (total_weight(patch) < least_weight) continue;
    if (!(share > 0)) continue;
    // On s = 2 (1 − R_k): R_k below about 0.7 counts less and less.
    any |= add(patch,
               new ceres::ScaledLoss(new ceres::CauchyLoss(0.75), share, ceres::TAKE_OWNERSHIP));
  }
  return any;
}

bool LevelProblem::add(const std::vector<WeightedPixel>& pixels, ceres::LossFunction* loss) {
  auto cost = std::make_unique<NccCost>(live_, pixels);
  if (!cost->usable()) {
    delete loss;
    return false;
  }
  problem_.AddResidualBlock(cost.release(), loss, state_.pose.data(), state_.light.data(),
                            &state_.log_focal);
  return true;
}

void LevelProblem::add_depth(std::unique_ptr<ceres::CostFunction> cost) {
  problem_.AddResidualBlock(cost.release(), nullptr, state_.pose.data(), &state_.log_depth_scale);
}

// R knows nothing of the light's scale, and a patch with its own gain and offset next to nothing of
// some of its directions: there the least-squares fit stands, or steps would turn the light round.
void LevelProblem::add_light_prior() {
  const double kWeight = split_ ? 0.1 : 0.01;
  const Eigen::VectorXd fitted = state_.light.head(live_.basis().size());
  const double size = fitted.norm();
  if (!(size > 0)) return;
  problem_.AddResidualBlock(new LightPrior(kWeight / size, fitted), nullptr, state_.light.data());
}

void LevelProblem::solve(int iterations) {
  // Gauss–Newton's error shrinks with the square of its step: this much is as good as none.
  constexpr double kSettled = 0.25;  // pixels
  add_light_prior();
  live_.stop_after(iterations, kSettled);
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = 1;  // threads are in the prediction: repeatable sums
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 0;
  options.gradient_tolerance = 1e-14;
  options.initial_trust_region_radius = 1e3;
  SettledStop stop(live_);
  options.callbacks = {&stop};
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
}

}  // namespace organbake
