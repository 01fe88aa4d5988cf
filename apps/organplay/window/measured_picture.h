// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/player/player.h"
#include "window/window_state.h"

namespace organbake {

// A frame of the player's organs as they are now, in the colours that were chosen (not none).
Rgb8Image measured_picture(const WindowState& state, const Player& player, const View& view,
                           const Frame& frame);

}  // namespace organbake
