// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "organbake/core/random.h"
#include "organbake/core/run_context.h"

namespace organbake {

enum class Outcome {
  right,
  refused,  // with an error that a user can mend
  wrong,
  not_finite,
  crashed,
  hung,  // took longer than a trial may
};
const char* name_of(Outcome outcome);
inline bool is_failure(Outcome outcome) { return outcome > Outcome::refused; }

// What became of one seeded input.
struct Trial {
  std::uint64_t seed = 0;
  std::string stage;
  Outcome outcome = Outcome::right;
  double error = 0;          // of a right or wrong one: share of what is allowed
  double cpu_ms = 0;         // 0 where it did not end
  std::string message = {};  // of any but a right one
};

// Thrown by a probe that got a result with numbers that are none.
struct NotFinite : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Puts one stage to an input drawn from a random stream, often an adversarial one.
struct Probe {
  const char* stage;
  const char* allowed;  // what an error of 1 means
  // The result's error as a share of what is allowed; 0 where there is nothing to measure. Throws
  // an organbake::Error when the input is refused. `folder` is for files.
  double (*run)(RandomStream& random, const std::filesystem::path& folder);
};
const std::vector<Probe>& all_probes();

// Seed k goes to probe k mod their number, in this very process: for a debugger.
Trial run_trial(std::uint64_t seed, const std::filesystem::path& folder,
                const std::vector<Probe>& probes = all_probes());

// Of one trial, in CPU time; longer ones hang. Sanitizers make 40 s of the slowest one's two.
#ifdef __SANITIZE_ADDRESS__
inline constexpr unsigned kMostSeconds = 300;
#else
inline constexpr unsigned kMostSeconds = 60;
#endif

struct Trials {
  std::uint64_t first_seed = 0, count = 0;
  int jobs = 1;
  std::filesystem::path folder;
  unsigned most_seconds = kMostSeconds;  // of the CPU
  // So many times that by the clock: what waits for nothing hangs as well, what only waits its turn
  // on a busy machine does not.
  unsigned patience = 10;
  const std::vector<Probe>& probes = all_probes();
};
// In processes of their own, so that a crash or a hang costs one trial only; in order of the
// seeds. `done` hears how many are. Call it before this process starts threads. Throws
// CancelledError.
std::vector<Trial> run_trials(const Trials& trials, const RunContext& context,
                              const std::function<void(std::size_t)>& done);

}  // namespace organbake
