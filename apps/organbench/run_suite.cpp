// SPDX-License-Identifier: GPL-3.0-or-later
#include "run_suite.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "organbake/core/parallel.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/pipelines/worker_process.h"
#include "report/run_json.h"

namespace organbake {
namespace {

void write_line(int fd, std::string line) {
  line += '\n';
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t n = ::write(fd, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    done += std::size_t(n);
  }
}

// Nothing thrown may climb into the copy of what the parent was doing: it ends as a crash.
void run_here(const Suite& suite, const BenchOptions& options, const RunContext& context,
              int fd) noexcept {
  std::optional<ThreadLimit> limit;
  if (options.threads > 0) limit.emplace(options.threads);
  Bench bench(options, context,
              [&](const SuiteResult& result) { write_line(fd, nlohmann::json(result).dump()); });
  try {
    for (const auto part : suite.parts) part(bench);
  } catch (const std::exception& error) {
    bench.fail(error.what());
  }
}

struct ChildProcess {
  pid_t process = 0;
  int fd = -1;  // to read what it writes, up to its end
};

// A copy of this process that runs the suite, and ends with this process.
ChildProcess start_child(const Suite& suite, const BenchOptions& options,
                         const RunContext& context) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process == 0) {
    end_with_parent(parent);
    ::close(ends[0]);
    run_here(suite, options, context, ends[1]);
    ::_exit(0);
  }
  ::close(ends[1]);
  if (process < 0) {
    ::close(ends[0]);
    throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  }
  return {process, ends[0]};
}

// Ends the child when it is asked to stop: a signal need not have reached the child, too.
std::string read_to_end(const ChildProcess& child, const RunContext& context) {
  std::string text;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(child.fd, buffer, sizeof buffer);
    if (context.cancelled()) ::kill(child.process, SIGKILL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    text.append(buffer, n);
  }
  ::close(child.fd);
  return text;
}

// Each line is the whole result so far; the last whole one counts.
SuiteResult last_result(const std::string& lines) {
  const std::size_t end = lines.rfind('\n');
  if (end == std::string::npos) return {};
  const std::size_t before = lines.rfind('\n', end - 1);
  const std::size_t begin = end == 0 || before == std::string::npos ? 0 : before + 1;
  return nlohmann::json::parse(lines.substr(begin, end - begin)).get<SuiteResult>();
}

}  // namespace

SuiteResult run_suite(const Suite& suite, const BenchOptions& asked, const RunContext& context) {
  const TemporaryFolder scratch;  // ours, not the child's: it goes away when the child is killed
  BenchOptions options = asked;
  options.scratch = scratch.path();
  const ChildProcess child = start_child(suite, options, context);
  SuiteResult result = last_result(read_to_end(child, context));
  int status = 0;
  while (::waitpid(child.process, &status, 0) < 0 && errno == EINTR) {
  }
  if (context.cancelled()) {
    result.failure = "stopped";
  } else if (WIFSIGNALED(status)) {
    result.failure = std::string("the suite crashed: ") + ::strsignal(WTERMSIG(status));
  }
  return result;
}

}  // namespace organbake
