// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/worker_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

constexpr int kCannotRun = 127;  // as shells say it

// Only what is allowed between fork and exec in a process that may have threads.
[[noreturn]] void become(char* const* arguments, int out, int error, pid_t parent) {
  end_with_parent(parent);
  const int nothing = ::open("/dev/null", O_RDONLY);
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(error, STDERR_FILENO);
  ::execv(arguments[0], arguments);
  ::_exit(kCannotRun);
}

int open_for_writing(const std::filesystem::path& file) {
  constexpr mode_t kMode = 0666;
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  if (fd < 0) throw IoError::writing(file, std::strerror(errno));
  return fd;
}

}  // namespace

void end_with_parent(pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCannotRun);  // it was killed before we could ask
}

pid_t start_worker(const std::vector<std::string>& command, const std::filesystem::path& out_file,
                   const std::filesystem::path& error_file) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const int out = open_for_writing(out_file), error = open_for_writing(error_file);
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process == 0) become(arguments.data(), out, error, parent);
  ::close(out);
  ::close(error);
  if (process < 0) {
    throw Error(ExitCode::try_again,
                std::string("no process can be started: ") + std::strerror(errno));
  }
  return process;
}

std::optional<WorkerEnd> wait_for_any_worker() {
  int status = 0;
  rusage usage{};
  const pid_t process = ::wait4(-1, &status, 0, &usage);
  if (process < 0 && errno == EINTR) return std::nullopt;
  if (process < 0) throw std::logic_error("wait_for_any_worker: there is none");
  constexpr double kKbPerMb = 1024;
  WorkerEnd end{process, 0, 0, double(usage.ru_maxrss) / kKbPerMb};
  if (WIFSIGNALED(status)) {
    end.signal = WTERMSIG(status);
    end.exit_code = 128 + end.signal;
  } else {
    end.exit_code = WEXITSTATUS(status);
  }
  return end;
}

WorkerEnd run_worker(const std::vector<std::string>& command, const std::filesystem::path& out_file,
                     const std::filesystem::path& error_file, const RunContext& context) {
  start_worker(command, out_file, error_file);
  std::optional<WorkerEnd> end;
  while (!(end = wait_for_any_worker())) context.throw_if_cancelled();
  if (end->exit_code != 0) {
    throw Error(ExitCode::internal, command.front() + " ended with " +
                                        std::to_string(end->exit_code) + ": " +
                                        read_text_file(error_file));
  }
  return *end;
}

}  // namespace organbake
