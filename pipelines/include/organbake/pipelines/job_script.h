// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// A batch cut into tasks for an engine that is not ours: each is `organbake batch` over one shard
// of the table cases.csv in the output folder.
struct JobPlan {
  std::filesystem::path program;       // organbake; absolute, as the other paths
  std::filesystem::path output;        // holds cases.csv
  std::vector<std::string> arguments;  // of batch, besides the table, -o, --threads and --shard
  std::size_t tasks = 1;
  int threads = 0;       // of a task; 0 = all there are (lines only)
  double memory_mb = 0;  // a task's, with a margin
  double minutes = 0;    // a task's, with a margin
};

// As one word of a POSIX shell: quoted unless it needs none.
std::string shell_word(const std::string& text);

// One command a line, for a shell, xargs or GNU parallel.
std::string job_lines(const JobPlan& plan);
// pipelines/cluster/Snakefile with its configuration. Throws UsageError for a path that is not
// UTF-8.
std::string job_snakefile(const JobPlan& plan);
// pipelines/cluster/array.sbatch with its values.
std::string job_array(const JobPlan& plan);

}  // namespace organbake
