// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <signal.h>
#include <unistd.h>
#include <limits>
#include <stdexcept>

#include "bench.h"
#include "organbake/core/files.h"
#include "report/report.h"

namespace organbake {
namespace {

using testing::HasSubstr;

std::size_t count(const std::string& text, const std::string& wanted) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(wanted, at)) != std::string::npos; ++at) ++n;
  return n;
}

TEST(ReportPage, PutsValuesUnderTheirOwnHeadings) {
  const Timing timing{3, {1, 1, 1}, {1, 1, 1}, 1};
  const std::vector<Point> points = {
      {"task", "first", false, {{"cameras", "", 11}}, timing, {{"gap", "%", 0.25}}},
      {"task", "second", false, {{"samples", "points", 77}}, timing, {{"over bound", "×", 1.5}}}};
  const std::string page =
      report_page({Effort::quick, {}, {{"suite", "", 1, {points, {}, {}, {}, ""}}}});
  EXPECT_THAT(page, HasSubstr("<th>cameras</th><th>samples, points</th>"));
  EXPECT_THAT(page, HasSubstr("<td>first</td><td>11</td><td></td>"));
  EXPECT_THAT(page, HasSubstr("<td>second</td><td></td><td>77</td>"));
  EXPECT_THAT(page, HasSubstr("<td>0.25</td><td></td></tr>"));
  EXPECT_THAT(page, HasSubstr("<td></td><td>1.5</td></tr>"));
  const std::size_t headings = count(page, "<th>");
  EXPECT_EQ(count(page, "<td>"), 2 * headings);
}

TEST(ReportPage, BeginsWithWhatItHoldsAndHowMuchOfItWasReached) {
  SuiteResult result;
  result.figures = {{"small", "mm", 1, 2}, {"large", "mm", 3, 2}};
  const std::string page =
      report_page({Effort::quick, {}, {{"suite", "", 60, result}, {"other", "", 30, {}}}});
  EXPECT_THAT(page, HasSubstr("It took 1.5 minutes"));
  EXPECT_THAT(page, HasSubstr("<a href='#suite'>suite</a> 1/2 · <a href='#other'>other</a></p>"));
}

TEST(ReportPage, TakesPicturesIntoItself) {
  SuiteResult result;
  result.pictures = {{"where it's <wrong>", "data:image/png;base64,AAAA", 3, 2}};
  const std::string page = report_page({Effort::quick, {}, {{"suite", "", 1, result}}});
  EXPECT_THAT(page, HasSubstr("width='3' height='2' src='data:image/png;base64,AAAA'"));
  EXPECT_EQ(count(page, "where it&#39;s &lt;wrong&gt;"), 2u) << "for the eye, and read aloud";
}

using testing::ElementsAre;
using testing::HasSubstr;

Point point(const std::string& subject, double ms, double error) {
  return {"task", subject, false, {}, {1, {ms, ms, ms}, {ms, ms, ms}, 0}, {{"error", "mm", error}}};
}

TEST(ParetoFront, HoldsWhatNothingBeatsInBoth) {
  const std::vector<Point> points = {point("a", 10, 1), point("b", 5, 2), point("c", 20, 1.5),
                                     point("d", 40, 0.1), point("e", 5, 3)};
  EXPECT_THAT(pareto_front(points), ElementsAre(1, 0, 3));
}

TEST(ParetoFront, OfEqualPointsHoldsOne) {
  EXPECT_EQ(pareto_front({point("a", 1, 1), point("b", 1, 1)}).size(), 1u);
}

TEST(ParetoFront, LeavesOutWhatWasNotTimed) {
  Point flat = point("flat plane", 0, 0.5);
  flat.timing.runs = 0;
  EXPECT_THAT(pareto_front({flat, point("a", 10, 1)}), ElementsAre(1));
}

TEST(TimeErrorChart, WhatWasNotTimedIsALevelAndStretchesNoAxis) {
  Point flat = point("flat plane", 0, 0.5);
  flat.timing.runs = 0;
  const std::string svg = time_error_chart({flat, point("a", 10, 1), point("a", 20, 0.2)});
  EXPECT_THAT(svg, testing::Not(HasSubstr(">0.0001<")));
  EXPECT_THAT(svg, HasSubstr(">10<"));
  EXPECT_THAT(time_error_chart({flat}), testing::Not(HasSubstr("nan")));
}

TEST(TimeErrorChart, SurvivesZeroErrorsAndOddNames) {
  const std::string svg = time_error_chart({point("a<b & 'c'", 1, 0)});
  EXPECT_THAT(svg, HasSubstr("a&lt;b &amp; &#39;c&#39;"));
  EXPECT_THAT(svg, testing::Not(HasSubstr("nan")));
  EXPECT_THAT(svg, testing::Not(HasSubstr("inf")));
}

TEST(TimeWorkChart, IsDrawnOfOneKnobThatGrows) {
  const auto load = [](double texels, double ms) {
    return Point{"t", "a", false, {{"texels", "", texels}}, {1, {ms, ms, ms}, {ms, ms, ms}, 0}, {}};
  };
  const std::vector<Point> points = {load(1000, 1), load(4000, 4)};
  EXPECT_TRUE(shows_growth(points));
  const std::string svg = time_work_chart(points);
  EXPECT_THAT(svg, HasSubstr(">texels<"));
  EXPECT_THAT(svg, HasSubstr("<title>a, texels 4000: 4 ms</title>"));
  EXPECT_FALSE(shows_growth({load(1000, 1)})) << "one point is no curve";
  EXPECT_FALSE(shows_growth({load(0, 1), load(1, 1)})) << "a logarithm needs something above 0";
  EXPECT_FALSE(shows_growth({point("a", 1, 1), point("a", 2, 1)})) << "it has an error to draw";
}

TEST(HeatColor, GrowsFromBlackToWhiteAndStaysThere) {
  float before = -1;
  for (const double share : {0.0, 0.1, 0.3, 0.5, 0.8, 1.0}) {
    const float sum = heat_color(share).sum();
    EXPECT_GT(sum, before) << share;
    before = sum;
  }
  EXPECT_EQ(heat_color(0).sum(), 0);
  EXPECT_EQ(heat_color(7), heat_color(1));
}

TEST(HeatColor, TellsWhatIsNotFiniteFromAnyError) {
  const Eigen::Vector3f color = heat_color(std::numeric_limits<double>::quiet_NaN());
  EXPECT_GT(color[2], color[0]) << "no error is bluer than red";
}

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
