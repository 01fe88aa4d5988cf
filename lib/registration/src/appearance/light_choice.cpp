// SPDX-License-Identifier: GPL-3.0-or-later
// The choice of a light by cross-validation over the squares of a chessboard: a light with more
// freedom fits better always, but predicts pixels that it was not fitted to better only when it is
// right.
#include "appearance/light_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {
namespace {

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
    own.light.model = trial.model;
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
