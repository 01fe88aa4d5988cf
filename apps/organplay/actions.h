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

// The first frame from --view, then frames of a slow orbit round an organ that is being poked,
// drawn and thrown away.
void run_bench(const Command& command, const RunContext& context);

// Says before any work what would keep a result from being written at its end, and refuses results
// that would overwrite what the command reads. Throws UsageError or IoError.
void check_outputs(const Command& command);

// Makes the data set of --dataset in the folder of -o. YAML is read by a module beside the program,
// organplay_yaml.so; where that was not built, a spec has to be JSON.
void run_dataset(const Command& command, const RunContext& context);

// Loads the window's module, which lies beside the program in ../lib/organbake, and runs it.
// Throws UsageError where it was not built or there is no display.
void open_window(const Command& command, const RunContext& context);

}  // namespace organbake
