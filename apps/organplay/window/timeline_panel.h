// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "window/window_state.h"

namespace organbake {

// What was done: undone and redone, recorded, replayed, saved, and a line of its time to go along.
void show_timeline(WindowState& state, LiveSession& session);

}  // namespace organbake
