// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace organbake {

// From now on SIGINT, SIGTERM and, unless it is ignored, SIGHUP ask the program to stop by the flag
// that is returned; a second SIGINT or SIGTERM ends it at once, with the exit code of what was
// interrupted. SIGXFSZ, of a limit on files' sizes, is ignored: writing fails then.
const std::atomic<bool>& catch_stop_signals();

}  // namespace organbake
