// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "organbake/motion/sightings.h"

namespace organbake {

// The poses of all frames between the first and the last posed view, each from the places that its
// features have, started from the nearest view. Nothing where too few of them agree.
std::vector<std::optional<RigidTransform>> pose_frames(const ClipTracks& clip,
                                                       const std::vector<std::size_t>& view_frames,
                                                       const Scene& scene);

}  // namespace organbake
