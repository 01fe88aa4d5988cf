// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "window/window_state.h"

namespace organbake {

// How the organ is looked at: scope, lens and light, colours and lines over it, what stands beside.
void show_look(WindowState& state, const Player& player, LiveSession& session,
               const TruthPictures& truth);

}  // namespace organbake
