// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "fake_stages.h"
#include "organbake/core/error.h"
#include "organbake/core/temporary_folder.h"
#include "support/error_message.h"

namespace organbake {
namespace {

using testing::HasSubstr;

class PlanTest : public testing::Test {
 protected:
  Plan plan(const std::string& body, const std::vector<std::string>& settings = {},
            const std::string& to = "") {
    const std::string head = "schema: organbake/recipe/1\n";
    return plan_bake(recipe_from(folder_.path(), head + body, settings), to);
  }
  static std::string stages(const Plan& plan) {
    std::string names;
    for (const Step& step : plan.steps) names += (names.empty() ? "" : " ") + step.stage->name;
    return names;
  }
  static std::string why_left_out(const Plan& plan, const std::string& what) {
    for (const LeftOut& item : plan.left_out) {
      if (item.what == what) return item.why;
    }
    return "it was not left out";
  }

  TemporaryFolder folder_;
};

constexpr const char* kAll = "phantom isosurface decimate mechanics place capture";

TEST_F(PlanTest, ThePhantomStandsInOnlyWhereTheRecipeAsksForIt) {
  EXPECT_EQ(stages(plan("phantom: {}\n")), kAll);
  EXPECT_THROW(plan(""), RecipeError);
  const Plan given = plan("phantom: {}\n", {"ct=scan.mha"});
  EXPECT_EQ(stages(given), "isosurface decimate mechanics place capture");
  EXPECT_EQ(why_left_out(given, "phantom"), "the ct is given");
}

TEST_F(PlanTest, AMaskNeedsNoCtAndNoPhantom) {
  EXPECT_EQ(stages(plan("phantom: {}\n", {"mask=seg.nii"})),
            "isosurface decimate mechanics place capture");
  EXPECT_EQ(plan("", {"mask=seg.nii"}).steps.front().inputs.size(), 1u);
  EXPECT_EQ(plan("", {"mask=seg.nii", "ct=scan.mha"}).steps.front().inputs.size(), 2u);
}

TEST_F(PlanTest, AGivenSurfaceLeavesOutWhatWouldHaveMadeIt) {
  const Plan given = plan("phantom: {}\n", {"surface=s.ply", "ct=scan.mha"});
  EXPECT_EQ(stages(given), "decimate mechanics place capture");
  EXPECT_EQ(why_left_out(given, "isosurface"), "the surface is given");
  EXPECT_EQ(why_left_out(given, "phantom"), "the ct is given");
  EXPECT_EQ(why_left_out(given, "input ct"), "no step of this bake reads it");
}

// As with liver.yaml, which has a section for the surface of a CT.
TEST_F(PlanTest, AGivenInputOutranksASection) {
  const std::string repaired = "repair decimate mechanics place capture";
  EXPECT_EQ(stages(plan("isosurface: {}\n", {"surface=s.ply", "repair.mode=auto"})), repaired);
  EXPECT_EQ(stages(plan("isosurface: {}\nrepair: {}\n", {"surface=s.ply"})), repaired);
  EXPECT_EQ(stages(plan("isosurface: {}\nrepair: {}\n", {"ct=scan.mha"})),
            "isosurface decimate mechanics place capture");
}

TEST_F(PlanTest, InputsAreConnectedToTheirMakers) {
  const Plan all = plan("phantom: {}\n");
  const Step& capture = all.steps.back();
  ASSERT_EQ(capture.inputs.size(), 5u);
  EXPECT_EQ(all.steps[capture.inputs[0].step].stage->name, "isosurface");
  EXPECT_EQ(capture.inputs[3].name, "photos");
  EXPECT_EQ(capture.inputs[3].file, "photos/cameras.json");
  EXPECT_EQ(capture.inputs[4].file, "photos/lighting.json");
  const Plan without = plan("", {"ct=scan.mha"});
  EXPECT_EQ(without.steps.back().inputs.size(), 3u) << "no photos: an optional input stays open";
  const Plan with = plan("", {"ct=scan.mha", "photos=p/cameras.json"});
  EXPECT_EQ(with.steps.back().inputs[3].given, "p/cameras.json");
}

TEST_F(PlanTest, DepthThatTwoEyesTellGoesIntoThePose) {
  std::vector<std::string> settings = {"surface=s.ply", "unposed=p/cameras.json"};
  const auto maker_of_depth = [&]() -> std::string {
    const Plan made = plan("", settings);
    for (const Step& step : made.steps)
      for (const InputSource& input : step.inputs)
        if (step.stage->name == "register" && input.name == "scope_depth")
          return made.steps[input.step].stage->name;
    return "none";
  };
  EXPECT_EQ(maker_of_depth(), "none");
  settings.insert(settings.end(), {"left=left.mp4", "right=right.mp4", "calibration=rig.yml"});
  EXPECT_EQ(maker_of_depth(), "stereo");
}

// What stages make is in millimetres and LPS, whatever the input was in.
TEST_F(PlanTest, TheUnitIsThatOfWhatIsGiven) {
  const auto unit_of = [](const Plan& plan, const std::string& stage) -> std::string {
    for (const Step& step : plan.steps)
      if (step.stage->name == stage)
        return nlohmann::json::parse(step.options_json).at("unit").get<std::string>();
    return "no such step";
  };
  const Plan given = plan("", {"surface=s.obj", "unit=cm"});
  for (const char* stage : {"decimate", "place", "capture"}) EXPECT_EQ(unit_of(given, stage), "cm");
  EXPECT_EQ(unit_of(given, "mechanics"), "auto");
  const Plan repaired = plan("", {"surface=s.obj", "unit=cm", "repair.mode=auto"});
  EXPECT_EQ(unit_of(repaired, "repair"), "cm");
  for (const char* stage : {"decimate", "place", "capture"})
    EXPECT_EQ(unit_of(repaired, stage), "auto") << stage;
  EXPECT_THAT(message_of(ExitCode::bad_recipe,
                         [&] {
                           plan("", {"ct=scan.mha", "unit=cm"});
                         }),
              testing::HasSubstr("unit is said of the inputs, but no step of this bake reads it"));
}

TEST_F(PlanTest, SaysWhoMakesWhatAnotherStageCouldMake) {
  const Plan moving = plan("motion: {}\nshade: {}\n", {"frames=clip.mp4"});
  EXPECT_EQ(why_left_out(moving, "shade"), "the surface is made by motion");
}

TEST_F(PlanTest, SaysWhatOfAQualityTheRecipeOutranks) {
  const Plan draft = plan("quality: draft\nplace: {count: 5}\n", {"ct=x"});
  EXPECT_EQ(why_left_out(draft, "place.count of quality draft"), "the recipe says 5");
  EXPECT_EQ(why_left_out(draft, "place.size_px of quality draft"), "it was not left out");
}

TEST_F(PlanTest, StopsAfterTheLastStageAskedFor) {
  EXPECT_EQ(stages(plan("phantom: {}\n", {}, "place")), "phantom isosurface place");
  EXPECT_EQ(stages(plan("", {"ct=x"}, "isosurface")), "isosurface");
  EXPECT_THROW(plan("", {"surface=x"}, "isosurface"), UsageError);
  EXPECT_THROW(plan("", {"ct=x"}, "nonsense"), UsageError);
}

TEST_F(PlanTest, AMissingInputIsNamedWithWhatToDo) {
  try {
    plan("");
    FAIL() << "it was accepted";
  } catch (const RecipeError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--set ct=PATH"));
  }
}

TEST_F(PlanTest, ASingleStageChecksItsInputs) {
  const Stage& decimate = *find_stage("decimate");
  const StageOptions options = decimate.make_options();
  EXPECT_THROW(plan_stage(decimate, options, {}), UsageError);
  const Plan single = plan_stage(decimate, options, {{"surface", "s.ply"}});
  EXPECT_EQ(single.steps.front().inputs.front().given, "s.ply");
}

}  // namespace
}  // namespace organbake
