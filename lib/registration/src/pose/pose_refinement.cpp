// SPDX-License-Identifier: GPL-3.0-or-later
// Coarse-to-fine refinement of a pose: at each level overlap, light and weights anew, then the
// solver. Coarse levels decide by the whole picture, the finest by patches. Where no light is
// given, the one is chosen that predicts pixels it was not fitted to.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "cost_functions/cost_functions.h"
#include "organbake/geometry/dense_solve.h"
#include "pose/poses.h"

namespace organbake {
namespace {

constexpr std::size_t kFewestRefinedPixels = 40;  // of an overlap, and of a patch
constexpr int kFinestBand = 5;                    // pixels beyond the outline
constexpr double kOtherLens = 0.7;                // |ln f| of a focal length beyond half or double

// Weighted least squares of the photograph's a by gain · b + offset.
struct LineFit {
  double w = 0, a = 0, b = 0, aa = 0, ab = 0, bb = 0;

  void add(double weight, double photo, double predicted) {
    w += weight;
    a += weight * photo;
    b += weight * predicted;
    aa += weight * photo * photo;
    ab += weight * photo * predicted;
    bb += weight * predicted * predicted;
  }
  // The sum of squares that is left.
  double unexplained() const {
    if (!(w > 0)) return 0;
    const double saa = aa - a * a / w, sab = ab - a * b / w, sbb = bb - b * b / w;
    return sbb > 0 ? saa - sab * sab / sbb : saa;
  }
};

// Whether one gain and offset over all pixels leave as little of the photograph unexplained as one
// of each for every square of `side` pixels, within what noise does. Then nothing varies slowly –
// no vignette, no albedo, no instrument – and the whole picture's R, which gives less away, is the
// efficient estimate.
bool one_gain_fits_all(const LivePrediction& live, const std::vector<WeightedPixel>& pixels,
                       int side) {
  // Squares of 24² pixels have 0.4 % fewer freedoms than pixels, and those cut by the outline more.
  constexpr double kNoiseAlone = 1.05;
  LineFit whole;
  std::map<std::pair<int, int>, LineFit> squares;
  for (const WeightedPixel& p : pixels) {
    const double photo = live.level().luminance[live.level().index(p.x, p.y)];
    const double predicted = live.radiance(p.x, p.y);
    whole.add(p.weight, photo, predicted);
    squares[{p.y / side, p.x / side}].add(p.weight, photo, predicted);
  }
  double by_squares = 0;
  for (const auto& [cell, square] : squares) by_squares += square.unexplained();
  return by_squares > 0 && whole.unexplained() <= kNoiseAlone * by_squares;
}

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
    state.usable = pixels.size() >= kFewestRefinedPixels;
    if (!state.usable) return;
    state.appearance = fit_appearance(level, live.prediction(), basis, pixels);
    state.solver.light = state.appearance.light;
    live.PrepareForEvaluation(false, true);

    const SolverState before = state.solver;
    LevelProblem problem(live, state.solver, options.free_focal);
    const bool whole = options.whole_picture || level.factor > 2 ||
                       (finest && one_gain_fits_all(live, pixels, options.patch_px));
    state.usable = whole ? problem.add_whole(pixels)
                         : problem.add_patches(pixels, options.patch_px, kFewestRefinedPixels);
    if (!state.usable) return;
    if (options.add_terms) options.add_terms(state, problem);
    problem.solve(steps);
    if (std::abs(state.solver.log_focal) > kOtherLens) {
      state.usable = false;
      return;
    }
    const bool done =
        outer + 1 == rounds || pixels_moved(level, surface, before, state.solver) < settled;
    if (!done) continue;
    live.PrepareForEvaluation(false, true);
    state.correlation = NccCost(live, pixels).correlation();
    break;
  }
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct HeldOut {
  std::vector<double> residuals;
  double noise = kInfinity;
};

HeldOut held_out(const RegisteredSurface& surface, const PhotoLevel& level,
                 const RefineOptions& options, const RefineState& state) {
  constexpr int kBand = 5;         // pixels beyond the outline, as when refining
  constexpr double kSquares = 8;   // across the organ
  constexpr int kLeastSquare = 6;  // pixels
  if (!state.usable) return {};
  const ObjectPose pose = state.solver.object_pose();
  const ShadingBasis basis = basis_for(options, pose);
  Prediction p;
  predict(surface, level, pose, std::exp(state.solver.log_focal), basis, state.solver.light,
          {.margin = kBand + 2}, p);
  std::vector<WeightedPixel> pixels = overlap(level, p, kBand);
  if (pixels.empty()) return {};
  const Appearance appearance = fit_appearance(level, p, basis, pixels);
  const double across_px =
      2 * level.intrinsics.fx * surface.radius_mm() / std::max(1e-9, pose.center_camera_mm.z());
  const int side = std::max(kLeastSquare, static_cast<int>(across_px / kSquares));
  return {held_out_residuals(level, p, basis, pixels, side), appearance.noise};
}

// Pixels that no light explains – instruments, highlights – count alike for all.
double capped_rms(const std::vector<double>& residuals, double cap) {
  if (residuals.empty()) return kInfinity;
  double sum = 0;
  for (const double r : residuals) sum += std::min(r * r, cap * cap);
  return std::sqrt(sum / static_cast<double>(residuals.size()));
}

}  // namespace

bool in_front(const RegisteredSurface& surface, const ObjectPose& pose) {
  return pose.center_camera_mm.allFinite() && pose.camera_from_world.coeffs().allFinite() &&
         pose.center_camera_mm.z() > 0.05 * surface.radius_mm();
}

ShadingBasis basis_for(const RefineOptions& options, const ObjectPose& pose) {
  return ShadingBasis(options.light, pose.center_camera_mm.norm());
}

void refine(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid, int first,
            int last, const RefineOptions& options, RefineState& state, const RunContext& context) {
  // Coarse levels by fours: what one leaves open is well below a pixel of it, and so within reach
  // of one four times as fine. The finer of them take the picture by patches, and each has its
  // turn.
  const auto next = [](int level) { return level >= 4 ? level - 2 : level - 1; };
  for (int i = first; i >= last; i = i > last ? std::max(last, next(i)) : i - 1) {
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

void appraise(const RegisteredSurface& surface, const PhotoLevel& level,
              const RefineOptions& options, RefineState& state) {
  const ShadingBasis basis = basis_for(options, state.solver.object_pose());
  state.solver.light = basis.first_weights();
  LivePrediction live(surface, level, basis, {.margin = kFinestBand + 2}, state.solver);
  live.PrepareForEvaluation(false, true);
  std::vector<WeightedPixel> pixels = overlap(level, live.prediction(), kFinestBand);
  state.usable = pixels.size() >= kFewestRefinedPixels;
  if (!state.usable) return;
  state.appearance = fit_appearance(level, live.prediction(), basis, pixels);
  state.solver.light = state.appearance.light;
  live.PrepareForEvaluation(false, true);
  state.correlation = NccCost(live, pixels).correlation();
}

Curvature curvature(const RegisteredSurface& surface, const PhotoLevel& level,
                    const RefineOptions& options, const RefineState& state) {
  Curvature result;
  const ShadingBasis basis = basis_for(options, state.solver.object_pose());
  LivePrediction live(surface, level, basis, {.margin = kFinestBand + 2}, state.solver);
  live.PrepareForEvaluation(true, true);
  std::vector<WeightedPixel> pixels = overlap(level, live.prediction(), kFinestBand);
  if (pixels.size() < kFewestRefinedPixels) return result;
  fit_appearance(level, live.prediction(), basis, pixels);
  const int motion = options.free_focal ? 7 : 6, light = basis.size(), all = motion + light;
  const NccCost::Linearization at_pose = NccCost(live, pixels).linearization();
  const Eigen::VectorXd& r = at_pose.residual;
  NccBlock::RowMajor j(r.size(), all);
  j << at_pose.derivative.leftCols(motion), at_pose.derivative.rightCols(light);

  // Marginalised: the motion's columns less what the light's explain of them.
  Eigen::MatrixXd normal = j.transpose() * j;
  Eigen::MatrixXd ll = normal.bottomRightCorner(light, light);
  ll.diagonal().array() += 1e-9 * ll.diagonal().maxCoeff() + 1e-300;
  const Eigen::MatrixXd explained = solve_symmetric(ll, normal.bottomLeftCorner(light, motion));
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

// The choice of a light by cross-validation over the squares of a chessboard: a light with more
// freedom fits better always, but predicts pixels that it was not fitted to better only when it is
// right.

std::vector<LightTrial> try_lights(const RegisteredSurface& surface,
                                   const std::vector<PhotoLevel>& pyramid, int first, int last,
                                   const RefineOptions& options,
                                   const std::vector<LightTrial>& starts,
                                   const RunContext& context) {
  constexpr double kCap = 3;  // standard deviations of what the best leaves
  std::vector<LightTrial> trials = starts;
  std::vector<HeldOut> rests;
  double noise = kInfinity;
  for (LightTrial& trial : trials) {
    RefineOptions own = options;
    own.light = trial.model;
    if (trial.state.usable) refine(surface, pyramid, first, last, own, trial.state, context);
    rests.push_back(held_out(surface, pyramid[last], own, trial.state));
    noise = std::min(noise, rests.back().noise);
  }
  for (std::size_t i = 0; i < trials.size(); ++i)
    trials[i].held_out_rms = capped_rms(rests[i].residuals, kCap * noise);
  return trials;
}

const LightTrial& simplest_of_best(const std::vector<LightTrial>& trials) {
  constexpr double kAsGood = 1.02;
  const auto best = std::min_element(
      trials.begin(), trials.end(),
      [](const LightTrial& a, const LightTrial& b) { return a.held_out_rms < b.held_out_rms; });
  return *std::find_if(trials.begin(), trials.end(), [&](const LightTrial& trial) {
    return trial.held_out_rms <= kAsGood * best->held_out_rms;
  });
}

}  // namespace organbake
