// SPDX-License-Identifier: GPL-3.0-or-later
#include "run_suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <stdexcept>

#include "organbake/core/files.h"

namespace organbake {
namespace {

using testing::HasSubstr;

SuiteResult run(void (*suite)(Bench&), const BenchOptions& options = {}) {
  return run_suite({"suite", "summary", {suite}}, options, {});
}

TEST(RunSuite, KeepsWhatWasFoundBeforeACrash) {
  const SuiteResult result = run([](Bench& bench) {
    bench.at_most("first", "mm", 1, 2);
    ::raise(SIGKILL);
  });
  EXPECT_EQ(result.figures.size(), 1u);
  EXPECT_THAT(result.failure, HasSubstr("crashed"));
}

TEST(RunSuite, KeepsWhatWasFoundBeforeItWasStopped) {
  const std::atomic<bool> stop_asked{true};
  const Suite slow{"suite", "summary", {[](Bench& bench) {
                     bench.at_most("first", "mm", 1, 2);
                     for (;;) ::pause();
                   }}};
  const SuiteResult result = run_suite(slow, {}, {{}, {}, &stop_asked});
  EXPECT_EQ(result.figures.size(), 1u);
  EXPECT_EQ(result.failure, "stopped");
}

TEST(RunSuite, LeavesNoFolderBehindACrash) {
  const SuiteResult result = run([](Bench& bench) {
    write_file_atomically(bench.scratch() / "file", "text");
    bench.skip(bench.scratch(), "the parent wants to know");
    ::raise(SIGKILL);
  });
  ASSERT_EQ(result.skipped.size(), 1u);
  EXPECT_TRUE(std::filesystem::path(result.skipped[0].what).is_absolute());
  EXPECT_FALSE(std::filesystem::exists(result.skipped[0].what));
}

TEST(TimeInTurn, EndsAtItsBudgetButNotBeforeTheLeastRounds) {
  int calls = 0;
  const auto work = [&] { ++calls; };
  const auto timings = time_in_turn({work}, {.most = 9, .least = 3, .budget_s = 0});
  EXPECT_EQ(timings[0].runs, 3);
  EXPECT_EQ(calls, 4);  // and the first, which is not counted
  EXPECT_EQ(time_in_turn({work}, {.most = 5, .least = 3, .budget_s = 1e6})[0].runs, 5);
}

TEST(RunSuite, TellsWhyASuiteEndedEarly) {
  const SuiteResult result = run([](Bench& bench) {
    bench.skip("a", "b");
    throw std::runtime_error("no phantom today");
  });
  EXPECT_EQ(result.skipped.size(), 1u);
  EXPECT_EQ(result.failure, "no phantom today");
}

TEST(RunSuite, CountsRoundsAndMemory) {
  const SuiteResult result = run(
      [](Bench& bench) {
        const auto touch = [](std::size_t mb) {
          const std::vector<char> memory(mb << 20, 1);
          ASSERT_EQ(memory.back(), 1);
        };
        const auto timings =
            bench.time(std::vector<std::function<void()>>{[&] { touch(64); }, [&] { touch(8); }});
        for (const Timing& t : timings) bench.add(Point{"task", "who", false, {}, t, {}});
      },
      {.rounds = 5, .data = {}});
  ASSERT_EQ(result.points.size(), 2u);
  EXPECT_EQ(result.points[0].timing.runs, 5);
  EXPECT_NEAR(result.points[0].timing.peak_mb, 64, 4);
  EXPECT_LE(result.points[0].timing.wall_ms.least, result.points[0].timing.wall_ms.median);
}

TEST(Bench, SaysWhatRealDataIsMissing) {
  const SuiteResult result = run(
      [](Bench& bench) { EXPECT_TRUE(bench.data("mesh/none.vtk").empty()); }, {.data = "/nowhere"});
  ASSERT_EQ(result.skipped.size(), 1u);
  EXPECT_EQ(result.skipped[0].what, "mesh/none.vtk");
}

}  // namespace
}  // namespace organbake
