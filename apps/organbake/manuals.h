// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "command_manual.h"

namespace organbake {

// organbake itself: its shared options and its commands, each with its page.
CommandManual program_manual();
// Every stage, then every other command, in the order in which help lists them.
std::vector<CommandManual> command_manuals();

}  // namespace organbake
