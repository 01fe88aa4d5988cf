// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/report_page.h"

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

}  // namespace
}  // namespace organbake
