// SPDX-License-Identifier: GPL-3.0-or-later
// The suites of organbench: how they are found, measure, and run.
#include "bench.h"

#include <map>
#include <optional>

#include "organbake/core/parallel.h"
#include "organbake/core/temporary_files.h"

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

}  // namespace organbake
