// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/evaluation_callback.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "appearance/prediction.h"

namespace organbake {

// The numbers that the solver moves. A longer lens takes the organ farther away: what is left of
// the picture's change is then perspective alone, and focal length and distance, which otherwise
// hardly differ, hardly trade against each other.
struct SolverState {
  std::array<double, 7> pose{};  // ObjectPose's, its z as it were with the given focal length
  ShadingBasis::Weights light = ShadingBasis::Weights::Zero();
  double log_focal = 0;        // of the scale of the given focal lengths
  double log_depth_scale = 0;  // of what the photograph's depth, where there is one, falls short by

  ObjectPose object_pose() const {
    ObjectPose found = ObjectPose::from_array(pose.data());
    found.center_camera_mm.z() *= std::exp(log_focal);
    return found;
  }
};

// At most how far the surface moves in the picture between two states, in pixels of the level.
double pixels_moved(const PhotoLevel& level, const RegisteredSurface& surface,
                    const SolverState& from, const SolverState& to);

// Draws the prediction once for every state that the solver visits; all cost functions of a problem
// read from it. What is seen and what is hidden is thereby always that of the very pose.
class LivePrediction : public ceres::EvaluationCallback {
 public:
  LivePrediction(const RegisteredSurface& surface, const PhotoLevel& level,
                 const ShadingBasis& basis, const PredictionSettings& settings,
                 const SolverState& state)
      : surface_(surface), level_(level), basis_(basis), settings_(settings), state_(state) {}

  // At most so many linearisations, and none within this many pixels of the last.
  void stop_after(int linearisations, double motion_px) {
    most_derivations_ = linearisations;
    settled_px_ = motion_px;
  }

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;

  // The last linearisation led to a state so near that another would gain nothing. Cost functions
  // then answer with slopes of zero, and Ceres stops where it stands: its own tolerances would drop
  // the last step, or ask for the slopes of a whole photograph to find that they are small.
  bool settled() const { return settled_; }

  const PhotoLevel& level() const { return level_; }
  const ShadingBasis& basis() const { return basis_; }
  const Prediction& prediction() const { return prediction_; }

  // Of a pixel of the level, inside the prediction's window or not.
  double radiance(int x, int y) const;
  PixelDerivative derivative(int x, int y) const;  // after evaluate_jacobians
  double phi(int x, int y, int j) const;

 private:
  void derive();
  bool settles() const;

  const RegisteredSurface& surface_;
  const PhotoLevel& level_;
  const ShadingBasis& basis_;
  PredictionSettings settings_;
  const SolverState& state_;
  Prediction prediction_;
  SolverState drawn_state_, traced_state_, derived_state_;
  bool drawn_ = false, derived_ = false, settled_ = false;
  int derivations_ = 0, most_derivations_ = std::numeric_limits<int>::max();
  double settled_px_ = 0;
  std::vector<std::array<float, 7>> derivatives_;
};

}  // namespace organbake
