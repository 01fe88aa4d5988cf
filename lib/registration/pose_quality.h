// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/global_search.h"
#include "registration/register_photo.h"

namespace organbake {

// Everything that is asked of a finished pose, and the verdict over it.
PoseQuality assess(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                   const RefineOptions& options, const RefineState& state, double runner_up_margin,
                   const RunContext& context);

// The share of the surface that faces the camera, and nothing of it hides, which lies inside the
// picture on pixels that count.
double visible_share(const RegisteredSurface& surface, const PhotoLevel& level,
                     const ObjectPose& pose);

}  // namespace organbake
