// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/player/orbit.h"
#include "organbake/player/player.h"

namespace organbake {

// The pose of the orbit's front view from which all organs are seen whole at rest, with a margin,
// in a picture of any shape. Of one organ the orbit's own: its cameras frame it already.
OrbitPose framing_pose(const Player& player);

}  // namespace organbake
