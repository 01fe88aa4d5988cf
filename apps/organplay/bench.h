// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "organbake/core/run_context.h"

namespace organbake {

// The first frame from --view, then frames of a slow orbit round an organ that is being poked,
// drawn and thrown away.
void run_bench(const Command& command, const RunContext& context);

}  // namespace organbake
