// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "appearance/photo_pyramid.h"
#include "appearance/prediction.h"
#include "organbake/registration/register_photo.h"
#include "pose/pose_refinement.h"

namespace organbake {

// Standard deviations of a pose: of its place, its turn, and the surface's points; by the
// covariance of its motion, or by what a photograph says of that.
void measure_spread(const RegisteredSurface& surface, const Eigen::Matrix<double, 6, 6>& covariance,
                    const ObjectPose& pose, PoseQuality& quality);
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

}  // namespace organbake
