// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"
#include "organbake/warp/view.h"

namespace organbake {

// Does everything that the command asks for and prints the results on stdout.
void run_command(const Command& command, const RunContext& context);

// From --view, in --size.
View view_of(const Command& command, const Bundle& bundle);

// How the skin is drawn: by the paper's warp, or by ours and in its own light where that is known.
DrawOptions drawing(const Command& command, const Player& player,
                    std::optional<DrawnLight> of_script = std::nullopt);

}  // namespace organbake
