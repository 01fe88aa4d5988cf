// SPDX-License-Identifier: Apache-2.0
#pragma once

// What organplay does when no window is asked for.

#include <functional>
#include <string>

#include "command.h"
#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"
#include "organbake/warp/view.h"

namespace organbake {

// Of a task by its name.
using ContextOf = std::function<RunContext(const std::string& task)>;

// Does everything that the command asks for and prints the results on stdout.
void run_command(const Command& command, const ContextOf& context_of);

// From --view-deg and --distance-mm, in --size.
View view_of(const Command& command, Player& player);

// How the skin is drawn: by the paper's warp, or by ours in the light that command or script name.
DrawOptions drawing(const Command& command, const Player& player,
                    std::optional<DrawnLight> of_script = std::nullopt);

// The first frame from --view, then frames of a slow orbit round an organ that is being poked,
// drawn and thrown away.
void run_bench(const Command& command, const RunContext& context);

}  // namespace organbake
