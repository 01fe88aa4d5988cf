// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "core/run_context.h"

namespace organbake {

// Does everything that the command asks for and prints the results on stdout.
void run_command(const Command& command, const RunContext& context);

// Frames of a slow orbit round an organ that is being poked, drawn and thrown away.
void run_bench(const Command& command, const RunContext& context);

}  // namespace organbake
