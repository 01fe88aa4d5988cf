// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"

namespace organbake {

// How a worker ended.
struct WorkerEnd {
  pid_t process = 0;
  int exit_code = 0;   // 128 + the signal's number when one killed it
  int signal = 0;      // 0: none
  double peak_mb = 0;  // most resident memory
};

// Runs a program to its end, as the only worker, its stdin empty. It ends with this process,
// however that ends. Throws Error with what it said when it fails, and as the context does when
// that is cancelled.
WorkerEnd run_worker(const std::vector<std::string>& command, const std::filesystem::path& out_file,
                     const std::filesystem::path& error_file, const RunContext& context);

// Memory that programs can have here: the machine's, or what a control group (cgroup v2: a
// container, a cluster's task) leaves of it. `total` whoever uses it now, `available` what is free
// for more, at least 1.
struct MachineMemory {
  double total_mb = 0, available_mb = 0;
};
MachineMemory machine_memory();

}  // namespace organbake
