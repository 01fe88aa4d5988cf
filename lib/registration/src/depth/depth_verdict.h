// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "depth/depth_alignment.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

// How the depth lies to the surface at a pose.
DepthFit depth_fit(const RegisteredSurface& surface, const SeenDepth& depth,
                   const DepthState& state);

// The verdict of a pose that depth took part in, by `quality.depth`, the standard deviations and
// what of the surface is in view.
void judge_with_depth(PoseQuality& quality);

}  // namespace organbake
