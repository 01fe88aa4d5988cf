// SPDX-License-Identifier: GPL-3.0-or-later
#include "child_process.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "organbake/pipelines/worker_process.h"

namespace organbake {
namespace {

// Nothing thrown may climb into the copy of what the parent was doing: it ends as a crash.
[[noreturn]] void be_child(const std::function<void(int fd)>& work, int fd) noexcept {
  work(fd);
  ::_exit(0);
}

}  // namespace

ChildProcess start_child(const std::function<void(int fd)>& work) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process == 0) {
    end_with_parent(parent);
    ::close(ends[0]);
    be_child(work, ends[1]);
  }
  ::close(ends[1]);
  if (process < 0) {
    ::close(ends[0]);
    throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  }
  return {process, ends[0]};
}

bool write_line(int fd, std::string line) {
  line += '\n';
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t n = ::write(fd, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += std::size_t(n);
  }
  return true;
}

int end_child(const ChildProcess& child, int signal) {
  if (signal != 0) ::kill(child.process, signal);
  ::close(child.fd);
  int status = 0;
  while (::waitpid(child.process, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace organbake
