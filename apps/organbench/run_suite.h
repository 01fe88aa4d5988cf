// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench.h"

namespace organbake {

// Runs a suite in a process of its own, so that its memory is its own and its crash ends nothing
// else: `failure` then says what happened, and what was found until then is kept. Call it before
// this process starts threads. The same holds after Ctrl-C.
SuiteResult run_suite(const Suite& suite, const BenchOptions& options, const RunContext& context);

}  // namespace organbake
