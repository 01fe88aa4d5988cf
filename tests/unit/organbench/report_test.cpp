// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

#include "bench.h"
#include "organbake/core/files.h"
#include "report/report.h"

namespace organbake {
namespace {

TEST(SuiteText, TellsPointsFiguresAndWhatIsMissing) {
  const Timing timing{3, {1.5, 1, 2}, {1, 1, 1}, 7};
  SuiteResult result;
  result.points = {{"task", "we", false, {{"cameras", "", 11}}, timing, {{"gap", "%", 0.25}}},
                   {"task", "they", true, {}, {}, {{"gap", "%", 0.5}}}};
  result.figures = {{"small", "mm", 1, 2}, {"large", "mm", 3, 2}};
  result.skipped = {{"a clip", "no --data"}};
  result.failure = "stopped";
  EXPECT_EQ(suite_text({"suite", "summary", 1.5, result}),
            "suite: summary (1.5 s)\n"
            "  task: we, cameras 11: 1.5 ms, CPU 1 ms, 7 MB; gap 0.25 %\n"
            "  task: they (peer):; gap 0.5 %\n"
            "  reached: small: 1 mm ≤ 2\n"
            "  MISSED:  large: 3 mm ≤ 2\n"
            "  left out: a clip: no --data\n"
            "  ended early: stopped\n");
}

RunReport run_with(Spread wall_ms, double error, bool peer = false) {
  const Point point{"task", "who", peer, {}, {3, wall_ms, wall_ms, 1}, {{"error", "mm", error}}};
  return {Effort::quick, {}, {{"suite", "", 1, {{point}, {}, {}, ""}}}};
}

TEST(CompareRuns, CallsSpreadsThatTouchTheSame) {
  const Comparison c = compare_runs(run_with({10, 9, 12}, 1), run_with({13, 11, 15}, 1));
  ASSERT_EQ(c.changes.size(), 2u);
  EXPECT_EQ(c.changes[0].kind, Change::Kind::same);
  EXPECT_FALSE(c.regressed());
}

TEST(CompareRuns, FindsSlowerAndLessAccurate) {
  EXPECT_TRUE(compare_runs(run_with({10, 9, 11}, 1), run_with({13, 12, 15}, 1)).regressed());
  EXPECT_TRUE(compare_runs(run_with({10, 9, 11}, 1), run_with({10, 9, 11}, 1.1)).regressed());
  const Comparison faster = compare_runs(run_with({13, 12, 15}, 1), run_with({10, 9, 11}, 1));
  EXPECT_EQ(faster.changes[0].kind, Change::Kind::better);
  EXPECT_FALSE(faster.regressed());
}

TEST(CompareRuns, LeavesPeersAndNamesWhatIsMissing) {
  EXPECT_TRUE(
      compare_runs(run_with({1, 1, 1}, 1, true), run_with({9, 9, 9}, 9, true)).changes.empty());
  const Comparison c = compare_runs(run_with({1, 1, 1}, 1), RunReport{});
  EXPECT_EQ(c.only_one.size(), 1u);
}

TEST(RunReport, ComesBackFromJson) {
  RunReport report = run_with({2, 1, 3}, 0.5);
  report.machine = {{"cores", "2"}};
  report.suites[0].result.figures = {{"what", "mm", 1, 2, Figure::Goal::at_least}};
  report.suites[0].result.skipped = {{"a", "b"}};
  report.suites[0].result.failure = "none";
  const nlohmann::json json = report;
  EXPECT_EQ(nlohmann::json(json.get<RunReport>()), json);
}

SuiteResult run(void (*suite)(Bench&), const BenchOptions& options = {}) {
  return run_suite({"suite", "summary", {suite}}, options, {});
}

TEST(RunSuite, KeepsWhatWasFoundBeforeItWasStopped) {
  const std::atomic<bool> stop_asked{true};
  const Suite slow{"suite", "summary", {[](Bench& bench) {
                     bench.at_most("first", "mm", 1, 2);
                     bench.time([] { FAIL() << "it goes on"; });
                   }}};
  const SuiteResult result = run_suite(slow, {}, {{}, {}, &stop_asked});
  EXPECT_EQ(result.figures.size(), 1u);
  EXPECT_EQ(result.failure, "stopped");
}

TEST(RunSuite, LeavesNoFolderBehind) {
  const SuiteResult result = run([](Bench& bench) {
    write_file_atomically(bench.scratch() / "file", "text");
    bench.skip(bench.scratch(), "the test wants to know");
    throw std::runtime_error("no more");
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
