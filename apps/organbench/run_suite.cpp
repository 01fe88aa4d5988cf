// SPDX-License-Identifier: GPL-3.0-or-later
#include "run_suite.h"

#include <signal.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "child_process.h"
#include "organbake/core/temporary_folder.h"
#include "result_json.h"

namespace organbake {
namespace {

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
std::string read_to_end(const ChildProcess& child, const RunContext& context) {
  std::string text;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(child.fd, buffer, sizeof buffer);
    if (context.cancelled()) ::kill(child.process, SIGKILL);
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
  const ChildProcess child = start_child([&](int fd) { run_here(suite, options, context, fd); });
  SuiteResult result = last_result(read_to_end(child, context));
  const int status = end_child(child);
  if (context.cancelled()) {
    result.failure = "stopped";
  } else if (WIFSIGNALED(status)) {
    result.failure = std::string("the suite crashed: ") + ::strsignal(WTERMSIG(status));
  }
  return result;
}

}  // namespace organbake
