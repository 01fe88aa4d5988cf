// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
