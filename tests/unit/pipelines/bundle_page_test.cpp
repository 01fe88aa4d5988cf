// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/bundle_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "organbake/pipelines/bake_warnings.h"
#include "organbake/pipelines/bundle_pictures.h"

namespace organbake {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

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
