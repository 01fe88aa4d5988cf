// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "organbake/core/error.h"
#include "organbake/core/temporary_folder.h"
#include "stability/trial.h"

namespace organbake {
namespace {

using Folder = std::filesystem::path;

double half_right(RandomStream&, const Folder&) { return 0.5; }
double wrong(RandomStream&, const Folder&) { return 3; }
double refuses(RandomStream&, const Folder&) { throw BadDataError("no organ in it"); }
double makes_nan(RandomStream&, const Folder&) { throw NotFinite("a vertex"); }
double crashes(RandomStream&, const Folder&) { return ::raise(SIGSEGV); }
double hangs(RandomStream&, const Folder&) {
  for (;;) ::pause();
}
double never_ends(RandomStream&, const Folder&) {
  for (volatile int turns = 0;;) turns = turns + 1;
}

TEST(RunTrials, TellsEveryEndApartAndLosesNoTrialBehindOne) {
  const std::vector<Probe> probes = {{"right", "", half_right}, {"refused", "", refuses},
                                     {"wrong", "", wrong},      {"not finite", "", makes_nan},
                                     {"crashed", "", crashes},  {"hung", "", hangs},
                                     {"hung", "", never_ends}};
  const TemporaryFolder folder;
  std::size_t last = 0;
  const auto found = run_trials({.count = 14,
                                 .jobs = 2,
                                 .folder = folder.path(),
                                 .most_seconds = 1,
                                 .patience = 2,
                                 .probes = probes},
                                {}, [&](std::size_t done) { last = done; });
  ASSERT_EQ(found.size(), 14u);
  for (std::size_t seed = 0; seed < found.size(); ++seed) {
    EXPECT_EQ(found[seed].seed, seed);
    EXPECT_EQ(name_of(found[seed].outcome), found[seed].stage);
  }
  EXPECT_GE(last, 1u);
}

TEST(RunTrials, StopsWhenAskedTo) {
  const std::vector<Probe> probes = {{"hung", "", hangs}};
  const TemporaryFolder folder;
  const std::atomic<bool> stop_asked{true};
  EXPECT_THROW(run_trials({.count = 1, .folder = folder.path(), .probes = probes},
                          {{}, {}, &stop_asked}, [](std::size_t) {}),
               CancelledError);
}

TEST(AllProbes, DoTheSameTrialBySeedAgain) {
  const TemporaryFolder folder;
  for (std::uint64_t seed = 0; seed < all_probes().size(); ++seed) {
    const Trial once = run_trial(seed, folder.path()), again = run_trial(seed, folder.path());
    EXPECT_EQ(once.outcome, again.outcome) << once.stage;
    EXPECT_EQ(once.error, again.error) << once.stage;
  }
}

}  // namespace
}  // namespace organbake
