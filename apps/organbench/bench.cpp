// SPDX-License-Identifier: GPL-3.0-or-later
// The suites of organbench: how they are found, measure, and run; what competes is timed in turn,
// so that whatever else the machine does falls on each alike. And a run told in lines, and the
// machine that it ran on.
#include "bench.h"

#include <CGAL/version.h>
#include <OpenMesh/Core/System/config.h>
#include <malloc.h>
#include <meshoptimizer.h>
#include <sys/resource.h>
#include <unistd.h>
#include <vtkVersionMacros.h>
#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <thread>

#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/documents.h"
#include "peers/peers.h"

namespace organbake {
namespace {

// A comparison whose rounds take seconds has few of them, or a run would take hours.
constexpr Rounds kQuick{.most = 1, .least = 1, .budget_s = 0.5},
    kUsual{.most = 9, .least = 1, .budget_s = 2};

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
  std::vector<std::function<void()>> stoppable;
  for (const auto& work : competitors) {
    stoppable.push_back([this, &work] {
      context_.throw_if_cancelled();
      work();
    });
  }
  if (options_.rounds > 0) return time_in_turn(stoppable, {options_.rounds, options_.rounds});
  return time_in_turn(stoppable, options_.quick ? kQuick : kUsual);
}

void Bench::add(Point point) { result_.points.push_back(std::move(point)); }

void Bench::point(const std::string& task, const std::string& subject, const Timing& timing,
                  const Quantities& errors, const Quantities& knobs) {
  add({task, subject, false, knobs, timing, errors});
}

void Bench::at_most(const std::string& what, const std::string& unit, double value, double target) {
  result_.figures.push_back({what, unit, value, target});
}

void Bench::at_least(const std::string& what, const std::string& unit, double value,
                     double target) {
  result_.figures.push_back({what, unit, value, target, Figure::Goal::at_least});
}

void Bench::skip(const std::string& what, const std::string& why) {
  result_.skipped.push_back({what, why});
}

void Bench::fail(const std::string& why) { result_.failure = why; }

SuiteResult run_suite(const Suite& suite, const BenchOptions& asked, const RunContext& context) {
  const TemporaryFolder scratch;
  BenchOptions options = asked;
  options.scratch = scratch.path();
  std::optional<ThreadLimit> limit;
  if (options.threads > 0) limit.emplace(options.threads);
  SuiteResult result;
  Bench bench(options, context, result);
  try {
    for (const auto part : suite.parts) part(bench);
  } catch (const std::exception& error) {
    result.failure = context.cancelled() ? "stopped" : error.what();
  }
  return result;
}

namespace {

// Of this process and of the programs that it ran and waited for.
double cpu_now_ms() {
  const auto ms = [](const timeval& t) { return 1e3 * t.tv_sec + 1e-3 * t.tv_usec; };
  double sum = 0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    sum += ms(usage.ru_utime) + ms(usage.ru_stime);
  }
  return sum;
}

// A line of /proc/self/status in MB: "VmRSS", or "VmHWM", the most since the mark was last reset.
double status_mb(const std::string& key) {
  constexpr double kKbPerMb = 1024;
  return number_behind(key + ":", "/proc/self/status").value_or(0) / kKbPerMb;
}

void reset_high_water_mark() {
  // Where the kernel forbids it, the mark only ever grows and the peak is an upper bound.
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w")) {
    std::fputs("5", file);
    std::fclose(file);
  }
}

struct Run {
  double wall_ms, cpu_ms;
};

Run run_once(const std::function<void()>& work) {
  const double cpu = cpu_now_ms();
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), cpu_now_ms() - cpu};
}

Run run_once(const std::function<void()>& work, double& peak_mb) {
  ::malloc_trim(0);  // what an earlier competitor freed must not be had for nothing
  reset_high_water_mark();
  const double before = status_mb("VmRSS");
  const Run run = run_once(work);
  peak_mb = std::max(0.0, status_mb("VmHWM") - before);
  return run;
}

struct Runs {
  std::vector<double> wall_ms, cpu_ms;
  void add(const Run& run) {
    wall_ms.push_back(run.wall_ms);
    cpu_ms.push_back(run.cpu_ms);
  }
};

}  // namespace

Spread spread_of(std::vector<double> values) {
  if (values.empty()) throw std::logic_error("spread_of: no values");
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {0.5 * (values[(n - 1) / 2] + values[n / 2]), values.front(), values.back()};
}

std::vector<Timing> time_in_turn(const std::vector<std::function<void()>>& competitors,
                                 const Rounds& rounds) {
  const std::size_t count = competitors.size();
  std::vector<Timing> timings(count);
  std::vector<Runs> runs(count);
  auto start = std::chrono::steady_clock::now();
  const auto passed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  for (std::size_t c = 0; c < count; ++c) runs[c].add(run_once(competitors[c], timings[c].peak_mb));
  const bool one_is_enough = rounds.least <= 1 && rounds.budget_s > 0;
  if (!one_is_enough || passed_s() < rounds.budget_s) {
    runs.assign(count, {});
    start = std::chrono::steady_clock::now();
    for (int done = 0; done < rounds.least || (done < rounds.most && passed_s() < rounds.budget_s);
         ++done) {
      for (std::size_t c = 0; c < count; ++c) runs[c].add(run_once(competitors[c]));
    }
  }
  for (std::size_t c = 0; c < count; ++c) {
    timings[c].runs = static_cast<int>(runs[c].wall_ms.size());
    timings[c].wall_ms = spread_of(runs[c].wall_ms);
    timings[c].cpu_ms = spread_of(runs[c].cpu_ms);
  }
  return timings;
}

namespace {

std::string with_unit(double value, const std::string& unit) {
  return page_number(value) + (unit.empty() ? "" : " " + unit);
}

std::string point_text(const Point& point) {
  std::string text = "  " + point.task + ": " + point.subject + (point.peer ? " (peer)" : "");
  for (const Quantity& knob : point.knobs)
    text += ", " + knob.name + " " + with_unit(knob.value, knob.unit);
  const char* before = ": ";
  if (point.timing.runs > 0) {
    text += before + with_unit(point.timing.wall_ms.median, "ms") + ", CPU " +
            with_unit(point.timing.cpu_ms.median, "ms") + ", " +
            with_unit(point.timing.peak_mb, "MB");
    before = "; ";
  }
  for (const Quantity& error : point.errors) {
    text += before + error.name + " " + with_unit(error.value, error.unit);
    before = "; ";
  }
  return text + "\n";
}

}  // namespace

std::string suite_text(const RunReport::SuiteReport& suite) {
  std::string text = suite.name + ": " + suite.summary + " (" + to_text(suite.seconds, 1) + " s)\n";
  for (const Point& point : suite.result.points) text += point_text(point);
  for (const Figure& f : suite.result.figures) {
    text += std::string(f.met() ? "  reached: " : "  MISSED:  ") + f.what + ": " +
            with_unit(f.value, f.unit) + (f.goal == Figure::Goal::at_most ? " ≤ " : " ≥ ") +
            page_number(f.target) + "\n";
  }
  for (const auto& skipped : suite.result.skipped)
    text += "  left out: " + skipped.what + ": " + skipped.why + "\n";
  if (!suite.result.failure.empty()) text += "  ended early: " + suite.result.failure + "\n";
  return text;
}

namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string memory() {
  constexpr double kBytesPerGb = double(1 << 30);
  const double bytes = double(::sysconf(_SC_PHYS_PAGES)) * double(::sysconf(_SC_PAGE_SIZE));
  return std::to_string(int(bytes / kBytesPerGb + 0.5)) + " GB";
}

std::string version(int major, int minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

std::map<std::string, std::string> describe_machine() {
  return {
      {"processor", processor()},
      {"cores", std::to_string(std::thread::hardware_concurrency())},
      {"memory", memory()},
      {"compiler", "g++ " __VERSION__},
      {"organbake", kVersion},
      {"VTK", VTK_VERSION},
      {"CGAL", CGAL_VERSION_STR},
      {"OpenMesh", version((OM_VERSION & 0xF0000) >> 16, (OM_VERSION & 0xFF00) >> 8)},
      // 1000 × major + 10 × minor + patch
      {"meshoptimizer", version(MESHOPTIMIZER_VERSION / 1000, MESHOPTIMIZER_VERSION % 1000 / 10)},
      {"Embree", embree_version()},
      {"Eigen", std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) +
                    "." + std::to_string(EIGEN_MINOR_VERSION)}};
}

}  // namespace organbake
