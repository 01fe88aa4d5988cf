// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"

namespace organbake {

// Where --draw gpu was asked for, loads what draws with graphics hardware without a window, lets
// the player draw by it, and says what it is. Throws UsageError where it is missing.
void draw_as_asked(const Command& command, Player& player, const RunContext& context);
// Warns where the processor had to draw the last picture all the same.
void warn_of_processor(const Command& command, const Player& player, const RunContext& context);

}  // namespace organbake
