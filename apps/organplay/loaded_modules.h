// SPDX-License-Identifier: Apache-2.0
#pragma once

// The parts of organplay that are loaded when they are asked for.

#include <string>

#include "command.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"

namespace organbake {

// A part of organplay that most runs have no use for, and that lies beside the program as
// ../lib/organbake/<file>: the window, drawing by graphics hardware, the comparison, data sets.
struct LoadedModule {
  std::string file;
  std::string missing;  // where there is no such file
  std::string failed;   // "<failed>: what the loader says"
  std::string instead;  // what to do without it
};

// Loads the module until the program ends, for OpenGL's drivers are not made to be unloaded, and
// returns its function `door`. Throws UsageError where it was not built or cannot be loaded.
void* load_door(const LoadedModule& module, const char* door);

// Where --draw gpu was asked for, loads what draws with graphics hardware without a window, lets
// the player draw by it, and says what it is. Throws UsageError where it is missing.
void draw_as_asked(const Command& command, Player& player, const RunContext& context);
// Warns where the processor had to draw the last picture all the same.
void warn_of_processor(const Command& command, const Player& player, const RunContext& context);

// Loads the window's module, which lies beside the program in ../lib/organbake, and runs it.
// Throws UsageError where it was not built or there is no display.
void open_window(const Command& command, const RunContext& context);

// Makes the data set of --dataset in the folder of -o, by a module.
void run_dataset(const Command& command, const RunContext& context);

}  // namespace organbake
