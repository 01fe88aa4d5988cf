// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>
#include <filesystem>
#include <optional>
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

// Starts a program with stdout and stderr sent to files, its stdin empty. It ends with this
// process, however that ends, so that nothing writes on behind a batch that was killed. Throws
// IoError.
pid_t start_worker(const std::vector<std::string>& command, const std::filesystem::path& out_file,
                   const std::filesystem::path& error_file);

// In a child process, right after the fork: it ends with its parent, however that ends.
void end_with_parent(pid_t parent);

// Waits until any worker ends; nothing when a signal came first.
std::optional<WorkerEnd> wait_for_any_worker();

// Runs a program to its end, as the only worker. Throws Error with what it said when it fails, and
// as the context does when that is cancelled.
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
