// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "window/window_state.h"

namespace organbake {

// The tool of the next touch, and what stands for the tissue.
void show_tools(WindowState& state, const Player& player, LiveSession& session);

}  // namespace organbake
