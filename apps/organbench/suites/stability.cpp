// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <map>
#include <numeric>
#include <thread>

#include "bench.h"
#include "stability/trial.h"
#include "suites.h"
#include "suites/cliffs.h"

namespace organbake {
namespace {

struct StageCount {
  std::map<Outcome, int> of;
  double worst_error = 0;
  std::vector<double> cpu_ms;
  int failures() const {
    int sum = 0;
    for (const auto& [outcome, count] : of) sum += is_failure(outcome) ? count : 0;
    return sum;
  }
};

std::map<std::string, StageCount> by_stage(const std::vector<Trial>& trials) {
  std::map<std::string, StageCount> stages;
  for (const Trial& trial : trials) {
    StageCount& stage = stages[trial.stage];
    ++stage.of[trial.outcome];
    stage.cpu_ms.push_back(trial.cpu_ms);
    if (trial.outcome == Outcome::right || trial.outcome == Outcome::wrong)
      stage.worst_error = std::max(stage.worst_error, trial.error);
  }
  return stages;
}

}  // namespace

void run_stability_suite(Bench& bench) {
  Trials trials;
  trials.first_seed = bench.options().first_case;
  trials.count = bench.options().cases > 0 ? bench.options().cases
                                           : std::uint64_t(bench.count(500, 5'000, 10'000));
  trials.jobs = bench.options().threads > 0 ? bench.options().threads
                                            : std::max(1, int(std::thread::hardware_concurrency()));
  trials.folder = bench.scratch();
  bench.now(std::to_string(trials.count) + " seeded inputs");
  const auto found = run_trials(trials, bench.context(), [&](std::size_t done) {
    bench.context().progress(double(done) / double(trials.count));
  });
  for (const auto& [stage, count] : by_stage(found)) {
    Point point{"seeded and adversarial inputs", stage, false, {}, {}, {}};
    for (const Outcome outcome : {Outcome::right, Outcome::refused, Outcome::wrong,
                                  Outcome::not_finite, Outcome::crashed, Outcome::hung}) {
      const auto n = count.of.find(outcome);
      point.knobs.push_back({name_of(outcome), "", n == count.of.end() ? 0. : double(n->second)});
    }
    const Spread cpu_ms = spread_of(count.cpu_ms);
    point.errors = {{"worst error / allowed", "×", count.worst_error},
                    {"CPU of a case, median", "ms", cpu_ms.median},
                    {"of the slowest", "ms", cpu_ms.most},
                    {"of all", "ms", std::reduce(count.cpu_ms.begin(), count.cpu_ms.end())}};
    bench.add(point);
    bench.add(
        Figure{stage + ": wrong, not finite, crashed or hung", "", double(count.failures()), 0});
  }
  for (const Trial& trial : found) {
    if (is_failure(trial.outcome))
      bench.add(FailedCase{trial.seed, trial.stage, name_of(trial.outcome), trial.message});
  }
  if (bench.options().cases == 0) find_cliffs(bench);  // who asks for a number wants them alone
}

}  // namespace organbake
