// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organ.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// `near_surface` brings a ray close to the surface, the formula gives the exact point.
Rgb8Image photograph_organ(const Organ& organ, const RayScene& near_surface,
                           const PosedCamera& camera, const RunContext& context);

}  // namespace organbake
