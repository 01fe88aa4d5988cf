// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "organbake/core/files.h"

namespace organbake {
namespace {

constexpr double kBytesPerMegabyte = 1024.0 * 1024.0;
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

double meminfo_mb(const std::string& key) {
  constexpr double kKbPerMb = 1024;
  const auto kb = number_behind(key + ":", "/proc/meminfo");
  return kb ? *kb / kKbPerMb : kNoLimit;
}

// A control group's file of one number of bytes, or "max".
double group_mb(const std::string& path, double otherwise) {
  std::ifstream file(path);
  double bytes = 0;
  return file >> bytes ? bytes / kBytesPerMegabyte : otherwise;
}

// Without what is kept of files that were read: it is given back when asked for.
double group_used_mb(const std::string& folder) {
  const double cached = number_behind("inactive_file", folder + "/memory.stat").value_or(0);
  return group_mb(folder + "/memory.current", 0) - cached / kBytesPerMegabyte;
}

// The folder of this process' group (cgroup v2: a line "0::/path").
std::string group_folder() {
  std::ifstream file("/proc/self/cgroup");
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with("0::")) return "/sys/fs/cgroup" + line.substr(3);
  }
  return {};
}

}  // namespace

MachineMemory machine_memory() {
  MachineMemory memory{meminfo_mb("MemTotal"), meminfo_mb("MemAvailable")};
  // Every group above this one may limit it, too.
  for (std::string folder = group_folder(); folder.size() > 1;
       folder.resize(folder.find_last_of('/'))) {
    const double limit = group_mb(folder + "/memory.max", kNoLimit);
    memory.total_mb = std::min(memory.total_mb, limit);
    memory.available_mb = std::min(memory.available_mb, limit - group_used_mb(folder));
  }
  constexpr double kLeast_mb = 1;  // none left is not "no limit"
  memory.available_mb = std::max(memory.available_mb, kLeast_mb);
  return memory;
}

}  // namespace organbake
