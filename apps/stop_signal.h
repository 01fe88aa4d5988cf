// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace organbake {

// From now on SIGINT and SIGTERM ask the program to stop by the flag that is returned; a second one
// ends it at once, with the exit code of what was interrupted.
const std::atomic<bool>& catch_stop_signals();

}  // namespace organbake
