// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/batch_run.h"

#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/documents.h"
#include "support/testing.h"

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

using nlohmann::json;
using testing::ElementsAre;

json report_of(const std::string& stage, const json& figures) {
  return {{"stages", {{{"stage", stage}, {"figures", figures}, {"skipped", json::array()}}}}};
}

TEST(BakeWarnings, AGoodBakeHasNone) {
  EXPECT_THAT(bake_warnings(report_of("capture", {{"bound_in_prism", 1000}})), ElementsAre());
  EXPECT_THAT(bake_warnings(report_of("place", {{"seen_by_1_share", 0.995}})), ElementsAre());
  EXPECT_THAT(bake_warnings(report_of("unknown", json::object())), ElementsAre());
}

TEST(BakeWarnings, NameTheStageAndTheFigure) {
  const json bound = {{"bound_in_prism", 900}, {"bound_by_fallback", 100}, {"back_face_texels", 0}};
  EXPECT_THAT(bake_warnings(report_of("capture", bound)),
              ElementsAre(testing::StartsWith("capture: 10 % of the texels")));
  EXPECT_THAT(
      bake_warnings(report_of("capture", {{"bound_in_prism", 980}, {"unbound_texels", 20}})),
      ElementsAre(HasSubstr("2 % of the texels lie where no face")));
  EXPECT_THAT(bake_warnings(report_of("capture", {{"bound_in_prism", 0}})),
              ElementsAre(HasSubstr("no camera shows anything")));
  EXPECT_THAT(bake_warnings(report_of("decimate", {{"volume_change", -0.1}})),
              ElementsAre(HasSubstr("-10 %")));
  EXPECT_THAT(bake_warnings(report_of("decimate", {{"volume_change", 5.4}, {"boundary_loops", 1}})),
              ElementsAre());
  EXPECT_THAT(bake_warnings(report_of("place", {{"seen_by_1_share", 0.5}})),
              ElementsAre(HasSubstr("50 %")));
  EXPECT_THAT(bake_warnings(report_of("register", {{"photos", 6}, {"registered", 4}})),
              ElementsAre(HasSubstr("2 of 6")));
}

TEST(BakeWarnings, AProxyThatDoesNotServeIsOne) {
  json figures = {{"worst_share_of_thickness", 0.4}, {"worst_mm", 1.2}, {"worst_thickness_mm", 3}};
  EXPECT_THAT(bake_warnings(report_of("decimate", figures)), ElementsAre());
  figures["worst_share_of_thickness"] = 8;
  EXPECT_THAT(bake_warnings(report_of("decimate", figures)),
              ElementsAre(HasSubstr("does not serve there")));
  figures["worst_share_of_thickness"] = 0.4;
  figures["share_of_thickness_asked"] = 0.05;
  figures["faces"] = 6000;
  EXPECT_THAT(bake_warnings(report_of("decimate", figures)),
              ElementsAre(HasSubstr("even 6000 faces do not reach it")));
}

TEST(StageWarnings, AreOneListOfWhatWasSaidAndWhatFiguresTell) {
  json stage = report_of("decimate", {{"self_intersecting_faces", 4}})["stages"][0];
  const std::string said = "4 faces of the proxy cross others; allow another number of faces";
  EXPECT_THAT(stage_warnings(stage, {said, "odd"}), ElementsAre(said, "odd"));
  EXPECT_THAT(stage_warnings(stage, {}), ElementsAre(said));
  stage["quality_gate"] = "too few";
  EXPECT_THAT(stage_warnings(stage, {"too few; take more"}),
              ElementsAre("too few; take more", said));
}

TEST(BakeWarnings, FiguresOfAnotherKindAreNotTrusted) {
  EXPECT_THAT(bake_warnings(report_of("place", {{"seen_by_1_share", "none"}})), ElementsAre());
}

// A map of one column: nothing, then near to far, the surface below the proxy and then above it.
CameraMaps column_maps() {
  CameraMaps maps;
  maps.width = 1;
  maps.height = 3;
  maps.depth_mm = {HUGE_VALF, 100, 140};
  maps.height_mm = {0, -2, 1};
  maps.face = {kNoFace, 0, 0};
  maps.confidence = {0, 1, 1};
  maps.color = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  return maps;
}

TEST(MapThumbnails, TellRangesAndShare) {
  const MapThumbnails small = map_thumbnails(column_maps(), 2);
  EXPECT_EQ(small.depth_mm.least, 100);
  EXPECT_EQ(small.depth_mm.most, 140);
  EXPECT_EQ(small.height_mm.least, -2);
  EXPECT_EQ(small.height_mm.most, 1);
  EXPECT_NEAR(small.filled_share, 2.0 / 3, 1e-12);
}

TEST(MapThumbnails, ShowWhatTheMapsHold) {
  const MapThumbnails small = map_thumbnails(column_maps(), 2);
  ASSERT_EQ(small.color.width, 1);
  ASSERT_EQ(small.color.height, 3);
  EXPECT_EQ(small.color.at(0, 1)[0], 255);
  EXPECT_EQ(small.color.at(0, 2)[1], 255);
  EXPECT_GT(small.depth.at(0, 1)[0], small.depth.at(0, 2)[0]) << "near is light";
  EXPECT_GT(small.micro.at(0, 1)[2], small.micro.at(0, 1)[0]) << "below the proxy is blue";
  EXPECT_GT(small.micro.at(0, 2)[0], small.micro.at(0, 2)[2]) << "above it is red";
}

TEST(MapThumbnails, LargeMapsAreAveragedAndEmptyOnesShown) {
  CameraMaps maps;
  maps.width = 4 * kThumbnailSide;
  maps.height = 2 * kThumbnailSide;
  const std::size_t texels = std::size_t(maps.width) * maps.height;
  maps.depth_mm.assign(texels, HUGE_VALF);
  maps.height_mm.assign(texels, 0);
  maps.face.assign(texels, kNoFace);
  maps.color.assign(texels, {0, 0, 0});
  const MapThumbnails small = map_thumbnails(maps, 1);
  EXPECT_EQ(small.color.width, kThumbnailSide);
  EXPECT_EQ(small.color.height, kThumbnailSide / 2);
  EXPECT_EQ(small.depth_mm.most, 0);
  EXPECT_EQ(small.filled_share, 0);
}

TEST(PageBeside, BearsTheBundlesName) {
  EXPECT_EQ(page_beside("a/organ"), "a/organ_report.html");
  EXPECT_EQ(page_beside("a/organ/"), "a/organ_report.html");
  EXPECT_EQ(page_beside("organ.v2"), "organ.v2_report.html");
  const std::filesystem::path here = std::filesystem::current_path();
  EXPECT_EQ(page_beside("."), here.string() + "_report.html");
}

}  // namespace
}  // namespace organbake
