// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/rigid_transform.h"

namespace organbake {

// How a scope moves over the tissue of MovingClip. `still`, `turn` (about its own lens) and `zoom`
// have no parallax; `orbit` and `tour` come back to where they began, and a tour goes sideways,
// nearer, and turns on its way.
enum class ScopePath { still, slide, approach, turn, orbit, tour, zoom };

struct ScopePose {
  RigidTransform camera_from_world;  // mm
  double zoom = 1;                   // focal length by the first frame's
};

// Where the scope is after a share 0…1 of the clip. The tissue lies some 30 to 90 mm from it.
ScopePose scope_pose(ScopePath path, double share);

}  // namespace organbake
