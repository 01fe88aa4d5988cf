// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "organbake/core/run_context.h"

namespace organbake {

// Loads the window's module, which lies beside the program in ../lib/organbake, and runs it.
// Throws UsageError where it was not built or there is no display.
void open_window(const Command& command, const RunContext& context);

}  // namespace organbake
