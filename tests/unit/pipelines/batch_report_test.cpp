// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/batch_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/document.h"
#include "organbake/pipelines/schemas.h"

namespace organbake {
namespace {

using testing::HasSubstr;

BatchRow good(const std::string& name, double rms_mm) {
  return {name, "written",          0, 1.5, 100, {{"decimate.rms_mm", rms_mm}}, {},
          {},   "pictures/a b.png", ""};
}
BatchRow bad(const std::string& name, int exit_code) {
  return {name, "failed", exit_code, 0.1, 10, {}, {}, "a,b: \"wrong\"\n<mend> it", {}, {}};
}
BatchRow warned(const std::string& name) {
  BatchRow row = good(name, 0.1);
  row.warnings = {"place: too few, \"they\" say", "capture: <odd>"};
  return row;
}

TEST(BatchReport, ComesBackFromItsJson) {
  const nlohmann::json json =
      batch_json("r.yaml", {good("one", 0.25), bad("two", 65), warned("three")});
  check_document(Document::parse_json(json.dump(), "batch.json"), "batch");
  EXPECT_EQ(batch_json("r.yaml", rows_of(json)), json);
}

TEST(BatchReport, ShardsJoinInTheOrderOfTheCases) {
  std::string order;
  for (const BatchRow& row :
       interleaved({{good("a", 1), good("d", 1)}, {good("b", 1), good("e", 1)}, {good("c", 1)}})) {
    order += row.name;
  }
  EXPECT_EQ(order, "abcde");
}

TEST(BatchReport, ARowIsOneLine) {
  const std::string csv = batch_csv({bad("two", 65)});
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2);
  EXPECT_THAT(csv, HasSubstr("\"a,b: \"\"wrong\"\" <mend> it\""));
}

TEST(BatchReport, TellsTheVerdictsOfFrames) {
  const nlohmann::json bake = {
      {"stages",
       {{{"stage", "stereo"}, {"figures", {{"frames_ok", 3}, {"frames_doubtful", 1}}}},
        {{"stage", "shade"}, {"figures", {{"frames_failed", 2}}}}}}};
  BatchRow row = good("a", 1);
  row.figures = key_figures(bake);
  const std::map<std::string, double> told = {
      {"stereo.frames_ok", 3}, {"stereo.frames_doubtful", 1}, {"shade.frames_failed", 2}};
  EXPECT_EQ(row.figures, told);
  EXPECT_THAT(batch_csv({row}), HasSubstr("stereo.frames_doubtful"));
  EXPECT_THAT(batch_page("r", {row}), HasSubstr("<th>stereo.<wbr>frames_ok"));
}

TEST(BatchReport, ThePageShowsTheWorstFirstAndOnlyWhatThereIs) {
  const std::string page = batch_page("r", {good("fine", 0.1), good("coarse", 2), bad("lost", 66)});
  EXPECT_LT(page.find("lost"), page.find("coarse"));
  EXPECT_LT(page.find("coarse"), page.find("fine"));
  EXPECT_THAT(page, HasSubstr("&lt;mend&gt;"));
  EXPECT_THAT(page, HasSubstr("pictures/a%20b.png"));
  EXPECT_THAT(page, HasSubstr("decimate.<wbr>rms_mm"));
  EXPECT_EQ(page.find("frames_shaded"), std::string::npos);
}

TEST(BatchReport, WarningsStandInTheTableAndOnThePage) {
  const std::string csv = batch_csv({warned("three")});
  EXPECT_THAT(csv, HasSubstr("\"place: too few, \"\"they\"\" say; capture: <odd>\""));
  EXPECT_THAT(csv.substr(0, csv.find('\n')), HasSubstr(",warnings,error"));
  const std::string page = batch_page("r", {good("coarse", 2), warned("three"), bad("lost", 66)});
  EXPECT_THAT(page, HasSubstr("capture: &lt;odd&gt;"));
  EXPECT_LT(page.find("lost"), page.find("three"));
  EXPECT_LT(page.find("three"), page.find("coarse"));
}

TEST(BatchReport, OfAnOlderBatchHasNoWarnings) {
  nlohmann::json json = batch_json("r.yaml", {good("one", 1)});
  json["cases"][0].erase("warnings");
  check_document(Document::parse_json(json.dump(), "batch.json"), "batch");
  EXPECT_TRUE(rows_of(json).front().warnings.empty());
}

TEST(BatchExitCode, AsksForAnotherTryOnlyWhenThatMayHelp) {
  EXPECT_EQ(exit_code_of({good("a", 1)}), ExitCode::ok);
  EXPECT_EQ(exit_code_of({good("a", 1), bad("b", 65)}), ExitCode::batch_partial);
  EXPECT_EQ(exit_code_of({bad("b", 128 + 11)}), ExitCode::batch_partial);  // a crash comes again
  EXPECT_EQ(exit_code_of({bad("a", 65), bad("b", 75)}), ExitCode::try_again);
  EXPECT_EQ(exit_code_of({bad("b", 128 + 9)}), ExitCode::try_again);
}

}  // namespace
}  // namespace organbake
