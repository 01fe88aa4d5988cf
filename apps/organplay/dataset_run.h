// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "organbake/core/run_context.h"

namespace organbake {

// Makes the data set of --dataset in the folder of -o. YAML is read by a module beside the program,
// organplay_yaml.so; where that was not built, a spec has to be JSON.
void run_dataset(const Command& command, const RunContext& context);

}  // namespace organbake
