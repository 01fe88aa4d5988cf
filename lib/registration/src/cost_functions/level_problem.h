// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/problem.h>

#include <memory>
#include <vector>

#include "cost_functions/live_prediction.h"
#include "cost_functions/ncc_cost.h"
#include "cost_functions/pose_manifold.h"

namespace organbake {

// What the solver climbs on one level of a photograph: R of the whole overlap, or of its patches,
// by pose, light and, when it is free, focal length. Moves `state`, as `live` draws it.
class LevelProblem {
 public:
  LevelProblem(LivePrediction& live, SolverState& state, Similarity similarity, bool free_focal);

  // False when the photograph is constant there.
  [[nodiscard]] bool add_whole(const std::vector<WeightedPixel>& pixels) {
    return add(pixels, nullptr);
  }
  // Each patch, a square of `side` pixels, has its own loss and counts by its contrast, so that the
  // sum is 1 − R's again when all fit. Patches of fewer than `least_weight` pixels are left out.
  [[nodiscard]] bool add_patches(const std::vector<WeightedPixel>& pixels, int side,
                                 double least_weight);
  // What else is known of the pose, in units of the photograph's 1 − R: by pose and depth's scale.
  void add_depth(std::unique_ptr<ceres::CostFunction> cost);
  void solve(int iterations);

 private:
  bool add(const std::vector<WeightedPixel>& pixels, ceres::LossFunction* loss);
  void add_light_prior();

  LivePrediction& live_;
  SolverState& state_;
  Similarity similarity_;
  bool split_ = false;  // into patches
  PoseManifold manifold_;
  ceres::Problem problem_;
};

}  // namespace organbake
