// SPDX-License-Identifier: GPL-3.0-or-later
// The rendering that all cost functions of a problem share, drawn once for each state that the
// solver visits; tracing rays is what costs.
#include "cost_functions/live_prediction.h"

#include <algorithm>
#include <cmath>
#include "organbake/core/parallel.h"

namespace organbake {

double pixels_moved(const PhotoLevel& level, const RegisteredSurface& surface,
                    const SolverState& from, const SolverState& to) {
  const ObjectPose pose = from.object_pose();
  const Motion motion = motion_between(pose, to.object_pose());
  const double depth = std::max(1e-9, pose.center_camera_mm.z());
  const double mm = motion.head<3>().norm() * surface.radius_mm() + motion.segment<2>(3).norm() +
                    std::abs(motion[5]) * surface.radius_mm() / depth;
  return level.intrinsics.fx * mm / depth +
         std::abs(to.log_focal - from.log_focal) * level.intrinsics.width / 2;
}

// Tracing is what costs: a state that only differs in its light is lit anew, one that was drawn
// last is not drawn again.
void LivePrediction::PrepareForEvaluation(bool evaluate_jacobians, bool) {
  const bool placed =
      drawn_ && drawn_state_.pose == state_.pose && drawn_state_.log_focal == state_.log_focal;
  if (!placed) {
    constexpr double kClose = 0.7;  // pixels: an outline stays within the pixels next to it
    settings_.keep_faces = drawn_ && pixels_moved(level_, surface_, traced_state_, state_) < kClose;
    if (!settings_.keep_faces) traced_state_ = state_;
    predict(surface_, level_, state_.object_pose(), std::exp(state_.log_focal), basis_,
            state_.light, settings_, prediction_);
  } else if (drawn_state_.light != state_.light) {
    relight(prediction_, state_.light);
  }
  if (!placed || drawn_state_.light != state_.light) derived_ = false;
  drawn_state_ = state_;
  drawn_ = true;
  if (!evaluate_jacobians || derived_) return;
  settled_ = settles();
  if (!settled_) derive();
}

bool LivePrediction::settles() const {
  if (derivations_ == 0) return false;
  return derivations_ >= most_derivations_ ||
         pixels_moved(level_, surface_, derived_state_, state_) < settled_px_;
}

void LivePrediction::derive() {
  Intrinsics lens = level_.intrinsics;
  lens.fx *= std::exp(state_.log_focal);
  lens.fy *= std::exp(state_.log_focal);
  const Eigen::Vector3d center = state_.object_pose().center_camera_mm;
  derivatives_.resize(prediction_.radiance.size());
  parallel_for(0, prediction_.height, [&](int row) {
    const int y = prediction_.top + row;
    for (int x = prediction_.left; x < prediction_.left + prediction_.width; ++x) {
      const PixelDerivative d =
          pixel_derivative(prediction_, lens, center, basis_, state_.light, x, y);
      for (int j = 0; j < 7; ++j)
        derivatives_[prediction_.index(x, y)][j] = static_cast<float>(d[j]);
    }
  });
  derived_ = true;
  derived_state_ = state_;
  ++derivations_;
}

double LivePrediction::radiance(int x, int y) const {
  if (prediction_.contains(x, y)) return prediction_.radiance[prediction_.index(x, y)];
  return state_.light[basis_.size() - 1];
}

double LivePrediction::phi(int x, int y, int j) const {
  if (prediction_.contains(x, y)) return prediction_.phi_at(prediction_.index(x, y))[j];
  return j == basis_.size() - 1 ? 1 : 0;
}

PixelDerivative LivePrediction::derivative(int x, int y) const {
  PixelDerivative d = PixelDerivative::Zero();
  if (!prediction_.contains(x, y)) return d;
  const auto& stored = derivatives_[prediction_.index(x, y)];
  for (int j = 0; j < 7; ++j) d[j] = stored[j];
  return d;
}

}  // namespace organbake
