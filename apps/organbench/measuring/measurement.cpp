// SPDX-License-Identifier: GPL-3.0-or-later
// Times what competes in turn, so that whatever else the machine does falls on each alike.
#include "measuring/measurement.h"

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "organbake/core/files.h"

namespace organbake {
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

}  // namespace organbake
