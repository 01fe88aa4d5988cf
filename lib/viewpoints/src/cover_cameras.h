// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cover_scene.h"
#include "organ_frame.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

// The fewest cameras found that reach options.coverage, chosen among even directions over the
// viewing region and a little beyond it (kBeyondRegion_rad) at one common distance, then moved
// between them; where views over the VPM would still miss more than `view_gap` of what they show,
// on average, cameras are added at the worst of them. Reached is what independent samples say. When
// the goal is out of reach (or of 256 cameras) the best is kept, with a warning. Throws
// BadDataError when no view of the region shows anything.
Placement cover_with_cameras(const TriangleMesh& surface, const OrganFrame& organ,
                             const PlacementOptions& options, const RunContext& context);

}  // namespace organbake
