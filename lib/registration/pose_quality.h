// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/refine.h"
#include "registration/register_photo.h"

namespace organbake {

// Standard deviations of a pose: of its place, its turn, and the surface's points.
void measure_spread(const RegisteredSurface& surface, const Curvature& curvature,
                    const ObjectPose& pose, PoseQuality& quality);

// Everything that is asked of a finished pose, and the verdict over it.
PoseQuality assess(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                   const RefineOptions& options, const RefineState& state, double runner_up_margin,
                   const RunContext& context);

}  // namespace organbake
