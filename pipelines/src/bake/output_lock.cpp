// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/output_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>

#include "organbake/core/error.h"
#include "organbake/pipelines/output_target.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Whoever held the lock before may have taken the file away: then the lock is of nothing.
bool is_still_there(int fd, const fs::path& file) {
  struct stat open {
  }, named{};
  return ::fstat(fd, &open) == 0 && ::stat(file.c_str(), &named) == 0 &&
         open.st_ino == named.st_ino && open.st_dev == named.st_dev;
}

}  // namespace

FileLock::FileLock(LockOptions options, const RunContext& context) : options_(std::move(options)) {
  constexpr std::chrono::milliseconds kPause{50};
  const Clock::time_point end = Clock::now() + options_.patience;
  bool told = false;
  while (!try_once()) {
    context.throw_if_cancelled();
    if (Clock::now() >= end) throw Error(ExitCode::try_again, options_.busy);
    if (!told) context.info("waits for another program that writes to the same place");
    told = true;
    std::this_thread::sleep_for(kPause);
  }
}

bool FileLock::try_once() {
  constexpr mode_t kMode = 0666;
  const int closing = options_.inherited ? 0 : O_CLOEXEC;
  const int fd = ::open(options_.file.c_str(), O_WRONLY | O_CREAT | closing, kMode);
  if (fd < 0 && !options_.inherited) return true;
  if (fd < 0)
    throw IoError::writing(options_.file, "cannot be made: " + std::string(std::strerror(errno)));
  const bool taken = ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!taken && is_still_there(fd, options_.file)) {
    fd_ = fd;
    return true;
  }
  ::close(fd);
  return false;
}

FileLock::~FileLock() {
  if (fd_ < 0) return;
  if (!options_.inherited) ::unlink(options_.file.c_str());
  ::close(fd_);
}

LockOptions output_lock(const fs::path& target) {
  constexpr std::chrono::minutes kPatience{2};
  const fs::path absolute = fs::absolute(target).lexically_normal();
  const fs::path named = absolute.has_filename() ? absolute : absolute.parent_path();
  make_folder_of(named);
  return {.file = named.parent_path() / ("." + named.filename().string() + ".lock"),
          .patience = kPatience,
          .busy = target.string() +
                  " is busy: another program has been writing it for minutes; wait for it, or name "
                  "another -o"};
}

}  // namespace organbake
