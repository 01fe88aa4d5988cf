// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbench/run_suite.h"

#include <signal.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "core/temporary_folder.h"
#include "organbench/result_json.h"

namespace organbake {
namespace {

void write_line(int fd, std::string line) {
  line += '\n';
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t n = ::write(fd, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;  // the parent is gone, and with it all interest
    done += n;
  }
}

void run_here(const Suite& suite, const BenchOptions& options, const RunContext& context, int fd) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  }
  Bench bench(options, context,
              [&](const SuiteResult& result) { write_line(fd, to_json(result).dump()); });
  try {
    suite.run(bench);
  } catch (const std::exception& error) {
    bench.fail(error.what());
  }
}

// Ends the child when it is asked to stop: a signal need not have reached the child, too.
std::string read_to_end(int fd, pid_t child, const RunContext& context) {
  std::string text;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(fd, buffer, sizeof buffer);
    if (context.cancelled()) ::kill(child, SIGKILL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    text.append(buffer, n);
  }
}

// Each line is the whole result so far; the last whole one counts.
SuiteResult last_result(const std::string& lines) {
  const std::size_t end = lines.rfind('\n');
  if (end == std::string::npos) return {};
  const std::size_t before = lines.rfind('\n', end - 1);
  const std::size_t begin = end == 0 || before == std::string::npos ? 0 : before + 1;
  return suite_result_from_json(nlohmann::ordered_json::parse(lines.substr(begin, end - begin)));
}

}  // namespace

SuiteResult run_suite(const Suite& suite, const BenchOptions& asked, const RunContext& context) {
  const TemporaryFolder scratch;  // ours, not the child's: it goes away when the child is killed
  BenchOptions options = asked;
  options.scratch = scratch.path();
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (child == 0) {
    ::close(ends[0]);
    run_here(suite, options, context, ends[1]);
    ::_exit(0);
  }
  ::close(ends[1]);
  SuiteResult result = last_result(read_to_end(ends[0], child, context));
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (context.cancelled()) {
    result.failure = "stopped";
  } else if (WIFSIGNALED(status)) {
    result.failure = std::string("the suite crashed: ") + ::strsignal(WTERMSIG(status));
  }
  return result;
}

}  // namespace organbake
