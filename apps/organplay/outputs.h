// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"

namespace organbake {

// Says before any work what would keep a result from being written at its end, and refuses results
// that would overwrite what the command reads. Throws UsageError or IoError.
void check_outputs(const Command& command);

}  // namespace organbake
