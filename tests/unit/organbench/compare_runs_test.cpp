// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/compare_runs.h"

#include "report/run_json.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

RunReport run_with(Spread wall_ms, double error, bool peer = false) {
  const Point point{"task", "who", peer, {}, {3, wall_ms, wall_ms, 1}, {{"error", "mm", error}}};
  return {Effort::quick, {}, {{"suite", "", 1, {{point}, {}, {}, {}, ""}}}};
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
  report.suites[0].result.pictures = {{"the worst", "data:image/png;base64,", 3, 2}};
  report.suites[0].result.failure = "none";
  const nlohmann::json json = report;
  EXPECT_EQ(nlohmann::json(json.get<RunReport>()), json);
}

}  // namespace
}  // namespace organbake
