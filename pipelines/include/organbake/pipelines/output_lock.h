// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "organbake/core/run_context.h"

namespace organbake {

struct LockOptions {
  std::filesystem::path file;
  // The file stays, and the processes that this one starts hold the lock as well; else it is taken
  // away again.
  bool inherited = false;
  std::chrono::milliseconds patience{0};  // for others
  std::string busy;                       // what is said when that was not enough
};

// The system's lock of a file, held while results are put in their place: of two programs that
// write to one place the second waits until the first is done, so that nothing of either is lost,
// mixed or read half-way. When one is killed, the next takes over at once.
class FileLock {
 public:
  // Throws Error (try again, 75) with the options' `busy`, CancelledError, or IoError when a file
  // that stays can't be made. Where the file system knows no locks, or lets nobody make the file,
  // all go on without: what is written next tells.
  explicit FileLock(LockOptions options, const RunContext& context = {});
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  bool try_once();

  LockOptions options_;
  int fd_ = -1;
};

// For what is written at `target`, a file or a folder: a hidden file beside it, ".organ.lock".
// Makes the folders above. Throws IoError (writing).
LockOptions output_lock(const std::filesystem::path& target);

}  // namespace organbake
