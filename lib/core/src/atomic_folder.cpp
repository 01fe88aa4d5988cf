// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <linux/fs.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// Hidden, next to the target (rename needs one file system), named after the process that owns it.
std::string temporary_prefix(const fs::path& target) {
  return "." + target.filename().string() + std::string(kTemporaryMark);
}

// renameat2, or its nearest likeness on file systems that know no flags (NFS): then a moment exists
// in which the old folder is gone and the new one not yet there, never a half-written one.
bool rename_folder(const fs::path& from, const fs::path& to, unsigned flags) {
  if (::syscall(SYS_renameat2, AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0) {
    return true;
  }
  if (errno != EINVAL && errno != ENOSYS) return false;
  std::error_code ignored;
  if (flags == RENAME_NOREPLACE && fs::exists(to, ignored)) {
    errno = EEXIST;
    return false;
  }
  if (flags == RENAME_EXCHANGE) remove_all_of(to);
  return ::rename(from.c_str(), to.c_str()) == 0;
}

IoError cannot_rename(const fs::path& target) {
  const std::string reason = std::strerror(errno);
  return IoError::writing(target, "cannot be renamed into place: " + reason);
}

fs::path without_slash(const fs::path& folder) {  // "out/" names the folder "out"
  return folder.has_filename() ? folder : folder.parent_path();
}

fs::path parent_of(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

}  // namespace

void AtomicFolder::sweep(const fs::path& target) {
  const fs::path folder = without_slash(target);
  const fs::path parent = parent_of(folder);
  remove_stale_temporaries(parent, temporary_prefix(folder));
  remove_stale_temporaries(parent,
                           folder.filename().string() + std::string(kTemporaryMark));  // of a file
}

void AtomicFolder::sweep_inside(const fs::path& folder) { remove_stale_temporaries(folder, {}); }

AtomicFolder::AtomicFolder(fs::path target) : target_(without_slash(target)) {
  const fs::path parent = parent_of(target_);
  std::error_code error;
  fs::create_directories(parent, error);
  const std::string prefix = temporary_prefix(target_);
  if (!error) remove_stale_temporaries(parent, prefix);
  static std::atomic<unsigned> counter{0};
  temporary_ = parent / (prefix + std::to_string(::getpid()) + "-" + std::to_string(counter++));
  if (!error) fs::create_directory(temporary_, error);
  if (error) throw IoError::writing(target_, "cannot be created: " + error.message());
}

AtomicFolder::~AtomicFolder() {
  if (committed_) return;
  remove_all_of(temporary_);
}

bool AtomicFolder::commit(IfExists if_exists) {
  if (rename_folder(temporary_, target_, RENAME_NOREPLACE)) return committed_ = true;
  if (errno != EEXIST) throw cannot_rename(target_);
  if (if_exists == IfExists::keep_existing) return false;
  // Swapping the two leaves no moment without a whole folder under the target's name.
  if (!rename_folder(temporary_, target_, RENAME_EXCHANGE)) throw cannot_rename(target_);
  committed_ = true;
  remove_all_of(temporary_);
  return true;
}

}  // namespace organbake
