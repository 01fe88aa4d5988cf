// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "window/window_state.h"

namespace organbake {

// Forces, depths and contacts, how long step and picture took, and what they were made of.
void show_readings(const WindowState& state, const LiveSession& session, const PlayedFrame& last);

}  // namespace organbake
