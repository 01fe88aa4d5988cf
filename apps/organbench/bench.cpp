// SPDX-License-Identifier: GPL-3.0-or-later
// The suites of organbench: how they are found, measure, and run, each in a process of its own.
#include "bench.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>

#include "organbake/core/parallel.h"
#include "organbake/core/temporary_files.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/processes.h"
#include "report/report.h"

namespace organbake {
namespace {

// A comparison whose rounds take seconds has few of them, or a run would take hours.
constexpr Rounds kRounds[] = {{.most = 1, .least = 1, .budget_s = 0.5},  // quick
                              {.most = 9, .least = 1, .budget_s = 2},    // standard
                              {.most = 9, .least = 3, .budget_s = 20}};  // thorough

// A function's own, so that it is there whichever file registers first.
std::map<std::string, Suite>& suites_by_name() {
  static std::map<std::string, Suite> suites;
  return suites;
}

}  // namespace

RegisteredPart::RegisteredPart(const std::string& name, void (*run)(Bench&),
                               const std::string& summary) {
  Suite& suite = suites_by_name()[name];
  suite.name = name;
  suite.parts.push_back(run);
  if (!summary.empty()) suite.summary = summary;
}

std::vector<Suite> all_suites() {
  std::vector<Suite> suites;
  for (const auto& [name, suite] : suites_by_name()) suites.push_back(suite);
  return suites;
}

std::filesystem::path Bench::data(const std::string& relative_path) {
  const std::filesystem::path path = options_.data / relative_path;
  if (!options_.data.empty() && std::filesystem::exists(path)) return path;
  skip(relative_path, options_.data.empty() ? "no folder of real data was given (--data)"
                                            : options_.data.string() + " does not hold it");
  return {};
}

std::vector<Timing> Bench::time(const std::vector<std::function<void()>>& competitors) const {
  if (options_.rounds > 0) return time_in_turn(competitors, {options_.rounds, options_.rounds});
  return time_in_turn(competitors, kRounds[int(options_.effort)]);
}

template <class Item>
void Bench::keep(std::vector<Item> SuiteResult::*list, Item item) {
  (result_.*list).push_back(std::move(item));
  found_(result_);
}

void Bench::add(Point point) { keep(&SuiteResult::points, std::move(point)); }

void Bench::point(const std::string& task, const std::string& subject, const Timing& timing,
                  const Quantities& errors, const Quantities& knobs) {
  add({task, subject, false, knobs, timing, errors});
}

void Bench::peer(const std::string& task, const std::string& subject, const Timing& timing,
                 const Quantities& errors, const Quantities& knobs) {
  add({task, subject, true, knobs, timing, errors});
}

void Bench::at_most(const std::string& what, const std::string& unit, double value, double target) {
  keep(&SuiteResult::figures, Figure{what, unit, value, target});
}

void Bench::at_least(const std::string& what, const std::string& unit, double value,
                     double target) {
  keep(&SuiteResult::figures, Figure{what, unit, value, target, Figure::Goal::at_least});
}

void Bench::show(const Rgb8Image& picture, const std::string& caption) {
  keep(&SuiteResult::pictures,
       Picture{caption, png_data_uri(picture), picture.width, picture.height});
}

void Bench::skip(const std::string& what, const std::string& why) {
  keep(&SuiteResult::skipped, SuiteResult::Skipped{what, why});
}

void Bench::fail(const std::string& why) {
  result_.failure = why;
  found_(result_);
}

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
