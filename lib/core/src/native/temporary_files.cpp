// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/temporary_files.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <fstream>
#include <optional>

namespace organbake {
namespace fs = std::filesystem;
namespace {

std::optional<pid_t> owner(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix)) return std::nullopt;
  const std::size_t mark = name.rfind(kTemporaryMark);
  if (mark == std::string::npos) return std::nullopt;
  const std::size_t number = mark + kTemporaryMark.size();
  if (!prefix.empty() && number != prefix.size()) return std::nullopt;
  pid_t pid = 0;
  const char* begin = name.data() + number;
  const auto result = std::from_chars(begin, name.data() + name.size(), pid);
  if (result.ec != std::errc() || pid <= 0) return std::nullopt;
  return pid;
}

// A process that nobody has waited for yet (a zombie) keeps its id, but will write no more. Its
// state stands behind its name, which is in parentheses and may hold some itself.
bool is_zombie(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');
  return name_end != std::string::npos && name_end + 2 < line.size() && line[name_end + 2] == 'Z';
}

bool alive(pid_t pid) { return (::kill(pid, 0) == 0 || errno == EPERM) && !is_zombie(pid); }

}  // namespace

fs::path temporary_file(const fs::path& file) {
  const std::string prefix = file.filename().string() + std::string(kTemporaryMark);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  remove_stale_temporaries(folder, prefix);
  return folder / (prefix + std::to_string(::getpid()));
}

void remove_all_of(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error) fs::remove_all(path, error);
}

void remove_stale_temporaries(const fs::path& folder, const std::string& prefix) {
  // A folder under a temporary name is new, and its writer's alone. It may get thousands of frames,
  // and looking through it for each would take longer than writing them.
  if (folder.native().find(kTemporaryMark) != std::string::npos) return;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const auto pid = owner(entry.path().filename().string(), prefix);
    if (pid && !alive(*pid)) remove_all_of(entry.path());
  }
}

}  // namespace organbake
