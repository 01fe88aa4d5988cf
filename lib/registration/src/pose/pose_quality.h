// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "appearance/photo_pyramid.h"
#include "appearance/prediction.h"
#include "organbake/registration/register_photo.h"
#include "pose/refine.h"

namespace organbake {

// Standard deviations of a pose: of its place, its turn, and the surface's points.
void measure_spread(const RegisteredSurface& surface, const Curvature& curvature,
                    const ObjectPose& pose, PoseQuality& quality);

// Everything that is asked of a finished pose, and the verdict over it.
PoseQuality assess(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                   const RefineOptions& options, const RefineState& state, double runner_up_margin,
                   const RunContext& context);

// What the photograph says of the focal length when it may differ from the given one: found
// together with the pose. Distance stands in for most of it, and an unmodelled light for some, so
// its own standard deviation comes with it.
struct FocalCheck {
  double log_scale = 0;  // ln of what the given one should be multiplied by
  double log_sd = 0;     // infinite when it cannot be told
};

FocalCheck check_focal(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                       RefineOptions options, const RefineState& state, const RunContext& context);

// Covariance of what the solver moved, over patches: H⁻¹ (Σ g gᵀ) H⁻¹ (White 1980; clustered,
// Liang & Zeger 1986). Not finite where nothing holds it.
Eigen::MatrixXd sandwich_covariance(const Curvature& curvature);

struct OutlineCheck {
  int places = 0;    // pixels of the outline
  int asked = 0;     // places along the outline where photograph and prediction vary at all
  double share = 0;  // of those, the prediction fits best within a pixel of where it is
};

// Shifts the predicted picture across its outline, place by place, up to 10 pixels either way, and
// looks where the photograph agrees best. R can be high for a wrong organ of about the right shape;
// that its outline lies right all round is another matter. `background` is the radiance beyond the
// prediction's window.
OutlineCheck check_outline(const PhotoLevel& level, const Prediction& prediction,
                           double background);

}  // namespace organbake
