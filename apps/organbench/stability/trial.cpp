// SPDX-License-Identifier: GPL-3.0-or-later
#include "stability/trial.h"

#include <cmath>
#include <ctime>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {

const char* name_of(Outcome outcome) {
  constexpr const char* kNames[] = {"right", "refused", "wrong", "not finite", "crashed", "hung"};
  return kNames[int(outcome)];
}

Trial run_trial(std::uint64_t seed, const std::filesystem::path& folder,
                const std::vector<Probe>& probes) {
  const Probe& probe = probes[seed % probes.size()];
  Trial trial{seed, probe.stage, Outcome::right};
  const auto end_as = [&trial](Outcome outcome, const std::string& message) {
    trial.outcome = outcome;
    trial.message = message;
  };
  RandomStream random(seed);
  const std::clock_t start = std::clock();
  try {
    trial.error = probe.run(random, folder);
    if (!std::isfinite(trial.error)) {
      trial.error = 0;
      end_as(Outcome::not_finite, "the error itself is not finite");
    } else if (trial.error > 1) {
      end_as(Outcome::wrong, to_text(trial.error, 3) + " × " + probe.allowed);
    }
  } catch (const NotFinite& error) {
    end_as(Outcome::not_finite, error.what());
  } catch (const Error& error) {
    const bool clear = error.code() != ExitCode::internal && *error.what() != '\0';
    end_as(clear ? Outcome::refused : Outcome::wrong, error.what());
  } catch (const std::exception& error) {
    end_as(Outcome::wrong, std::string("no error for users: ") + error.what());
  }
  trial.cpu_ms = 1e3 * double(std::clock() - start) / CLOCKS_PER_SEC;
  return trial;
}

}  // namespace organbake
