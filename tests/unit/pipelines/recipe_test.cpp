// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/recipe.h"

#include "fake_stages.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/pipelines/runner.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

using testing::HasSubstr;

constexpr const char* kHead = "schema: organbake/recipe/1\n";

class RecipeTest : public testing::Test {
 protected:
  Recipe read(const std::string& body, const std::vector<std::string>& settings = {}) {
    return recipe_from(folder_.path(), kHead + body, settings);
  }
  std::string error(const std::string& body, const std::vector<std::string>& settings = {}) {
    return message_of(ExitCode::bad_recipe, [&] { read(body, settings); });
  }
  static std::int64_t integer(const Recipe& recipe, const std::string& stage, const char* option) {
    return std::get<std::int64_t>(recipe.options.at(stage).list.find(option)->get());
  }
  static double number(const Recipe& recipe, const std::string& stage, const char* option) {
    return std::get<double>(recipe.options.at(stage).list.find(option)->get());
  }

  TemporaryFolder folder_;
};

TEST_F(RecipeTest, TheDefaultsAreValid) {
  const Recipe recipe = read("");
  EXPECT_EQ(recipe.name, "recipe") << "the file's name, when it says none";
  EXPECT_TRUE(recipe.inputs.empty());
  EXPECT_TRUE(recipe.sections.empty());
  EXPECT_EQ(number(recipe, "decimate", "faces"), 80);
}

TEST_F(RecipeTest, SectionsSettingsAndInputsArrive) {
  const Recipe recipe =
      read("name: a b\ninputs: {ct: scan.mha, label: 5}\ndecimate: {faces: 90}\nplace:\n",
           {"decimate.faces=100", "place.cone-axis=0,0,1", "mask=m.nii", "bundle.surface=true"});
  EXPECT_EQ(recipe.name, "a b");
  EXPECT_EQ(recipe.inputs.at("ct"), folder_.path() / "scan.mha") << "relative to the recipe";
  EXPECT_EQ(recipe.inputs.at("mask"), "m.nii") << "relative to the current folder";
  EXPECT_EQ(std::get<std::string>(recipe.options.at("isosurface").list.find("label")->get()), "5");
  EXPECT_EQ(number(recipe, "decimate", "faces"), 100);
  EXPECT_TRUE(recipe.sections.contains("place")) << "an empty section is there, with its defaults";
  EXPECT_TRUE(recipe.bundle.surface);
}

TEST_F(RecipeTest, WhoForgetsTheRecipeIsToldTheWholeCommand) {
  const auto told = [&](const std::string& name, const std::string& content) {
    write_file_atomically(folder_.path() / name, content);
    return message_of(ExitCode::usage, [&] { read_recipe(folder_.path() / name, {}); });
  };
  const std::string folder = folder_.path().string();
  EXPECT_THAT(told("CT.nii.gz", "x"), HasSubstr("--set ct=" + folder + "/CT.nii.gz -o BUNDLE"));
  EXPECT_THAT(told("slice", std::string(128, '\0') + "DICM"), HasSubstr("--set ct="));
  EXPECT_THAT(told("organ.stl", "x"), HasSubstr("--set surface="));
  EXPECT_THAT(told("clip.mp4", "x"), HasSubstr("organbake bake laparoscopy --set frames="));
  EXPECT_THAT(told("cases.csv", "case\n"), HasSubstr("organbake batch"));
  EXPECT_THROW(read_recipe(folder_.path(), {}), UsageError) << "a folder";
  EXPECT_THROW(read_recipe(folder_.path() / "missing.nii", {}), NoInputError);
}

TEST_F(RecipeTest, UnitAndSpaceAreOfTheInputAndHoldForAllStages) {
  const auto said = [](const Recipe& recipe, const std::string& stage, const char* key) {
    return std::get<std::string>(recipe.options.at(stage).list.find(key)->get());
  };
  for (const Recipe& recipe : {read("inputs: {surface: s.obj, unit: cm, space: RAS}\n"),
                               read("", {"surface=s.obj", "unit=cm", "space=ras"}),
                               read("capture: {unit: cm}\nplace: {space: RAS}\n"),
                               read("capture: {unit: cm}\n", {"unit=cm", "repair.space=RAS"})})
    for (const char* stage : {"repair", "decimate", "mechanics", "place", "register", "capture"}) {
      EXPECT_EQ(said(recipe, stage, "unit"), "cm") << stage;
      EXPECT_EQ(said(recipe, stage, "space"), "RAS") << stage;
    }
  const Recipe lens = read("capture: {unit: cm}\n");
  EXPECT_EQ(said(lens, "stereo", "unit"), "mm") << "a surface's unit is not a lens's";
  EXPECT_EQ(said(read("inputs: {unit: m}\n"), "stereo", "unit"), "m");
  EXPECT_EQ(said(read("inputs: {unit: m}\nstereo: {unit: cm}\n"), "stereo", "unit"), "cm");
}

TEST_F(RecipeTest, UnitsThatContradictEachOtherAreRefusedByName) {
  const std::string told = error("capture:\n  unit: m\n", {"unit=cm"});
  EXPECT_THAT(told, HasSubstr("recipe.yaml:3: capture.unit is \"m\", but inputs.unit is \"cm\""));
  EXPECT_THAT(told, HasSubstr("--set unit="));
  EXPECT_THAT(error("", {"place.unit=mm", "decimate.unit=cm"}), HasSubstr("decimate.unit"));
  EXPECT_THAT(error("", {"space=RAS", "capture.space=LPS"}), HasSubstr("capture.space"));
  EXPECT_THAT(error("", {"unit=km"}), HasSubstr("--set unit=km: 'km' is not possible"));
  EXPECT_THAT(error("inputs: {unit: km}\n"), HasSubstr("recipe.yaml:2: inputs.unit"));
}

TEST_F(RecipeTest, AnEmptySettingTakesAnInputAway) {
  EXPECT_TRUE(read("inputs: {ct: scan.mha}\n", {"ct="}).inputs.empty());
  EXPECT_THAT(error("", {"ct="}),
              HasSubstr("--set ct=: the value is empty, and the recipe has no ct to take away"));
}

TEST_F(RecipeTest, ErrorsNameLineKeyAndTheNearestKey) {
  EXPECT_THAT(error("decimate: {facs: 3}\n"),
              HasSubstr("recipe.yaml:2: unknown key 'decimate.facs'; did you mean 'faces'?"));
  EXPECT_THAT(error("\ndecimat: {faces: 3}\n"),
              HasSubstr("recipe.yaml:3: unknown key 'decimat'; did you mean 'decimate'?"));
  EXPECT_THAT(error("inputs: {ctt: x}\n"), HasSubstr("'inputs.ctt'; did you mean 'ct'?"));
  EXPECT_THAT(error("decimate:\n  faces: 3\n"),
              HasSubstr("recipe.yaml:3: decimate.faces is 3; it must be a number, at least 4"));
  EXPECT_THAT(error("decimate:\n  method: magic\n"), HasSubstr("lindstrom-turk"));
  EXPECT_THAT(error("capture: {material: Livr}\n"), HasSubstr("did you mean 'liver'?"));
  EXPECT_THAT(error("place: {field_of_view: 70}\n"),
              HasSubstr("'place.field_of_view'; did you mean 'field_of_view_deg'?"));
  EXPECT_THAT(error("decimate: 80\n"), HasSubstr("decimate is 80; it must be a group of keys"));
}

// Whichever of two stages reads the clip in the end.
TEST_F(RecipeTest, WhatTwoStagesTakeIsSaidOnce) {
  EXPECT_EQ(number(read("", {"motion.range_mm=120"}), "shade", "range_mm"), 120);
  EXPECT_EQ(number(read("motion: {range_mm: 80}"), "shade", "range_mm"), 80);
  EXPECT_EQ(number(read("motion: {range_mm: 80}", {"shade.range_mm=70"}), "shade", "range_mm"), 70);
  EXPECT_EQ(number(read(""), "shade", "range_mm"), 0);
}

TEST_F(RecipeTest, ARetiredSettingIsPassedOverWithANote) {
  for (const auto& [text, setting] :
       {std::pair("shade: {from_previous: true, texture: 0.1}\n", ""),
        std::pair("shade: {texture: 0.1}\n", "shade.from-previous=true")}) {
    const Recipe recipe =
        read(text, *setting ? std::vector<std::string>{setting} : std::vector<std::string>{});
    EXPECT_EQ(recipe.options.at("shade").list.find("texture")->get(), OptionValue(0.1));
    EXPECT_THAT(
        recipe.notes,
        testing::ElementsAre(testing::StartsWith("shade.from_previous is no longer a setting: ")));
  }
}

TEST_F(RecipeTest, ErrorsOfSettingsNameTheSetting) {
  EXPECT_THAT(error("", {"decimate.facs=3"}), HasSubstr("--set decimate.facs=3: unknown key"));
  // A group that is nowhere in the file is the setting's own.
  EXPECT_THAT(error("", {"place.size_px=64", "plase.size=64"}),
              HasSubstr("--set plase.size=64: unknown key 'plase'"));
  EXPECT_THAT(error("", {"decimate.faces=x"}), HasSubstr("--set decimate.faces=x: 'x' is not"));
  EXPECT_THAT(error("", {"faces=9"}), HasSubstr("say decimate.faces"));
  EXPECT_THAT(error("", {"place.count=soft"}), HasSubstr("--set place.count=soft"));
  EXPECT_THAT(error("", {"decimate"}), HasSubstr("key=value"));
  EXPECT_THAT(error("", {"a/b=c"}), HasSubstr("unknown key 'inputs.a"));
  EXPECT_THAT(error("", {"~x=c"}), HasSubstr("unknown key"));
  EXPECT_THAT(error("decimate: 80\n", {"decimate.faces=9"}), HasSubstr("something else than keys"));
  EXPECT_THAT(error("inputs: [1]\n", {"ct=x"}), HasSubstr("something else than keys"));
  EXPECT_THAT(error("", {"name=\xff"}), HasSubstr("UTF-8"));
  EXPECT_THAT(error("", {"colour=red"}), HasSubstr("unknown key 'inputs.colour'"));
}

TEST_F(RecipeTest, AQualityStandsBelowTheRecipeAndItsSettings) {
  const Recipe recipe =
      read("quality: draft\nplace: {count: 5}\n", {"place.size_px=300", "decimate.flips=false"});
  EXPECT_EQ(recipe.quality, "draft");
  EXPECT_EQ(integer(recipe, "capture", "rays_per_texel_side"), 1) << "the draft's";
  EXPECT_EQ(integer(recipe, "place", "count"), 5) << "the recipe's";
  EXPECT_EQ(integer(recipe, "place", "size_px"), 300) << "the setting's";
  ASSERT_EQ(recipe.outranked.size(), 3u);
  EXPECT_EQ(recipe.outranked[1].option, "place.count");
  EXPECT_EQ(recipe.outranked[1].value, "5");
  EXPECT_FALSE(recipe.sections.contains("capture")) << "a quality asks for no stage";
  EXPECT_EQ(read("quality: draft\n", {"quality=fine"}).quality, "fine");
}

TEST_F(RecipeTest, WithoutAQualityABakeIsOfStandardQuality) {
  const Recipe none = read(""), standard = read("quality: standard\n");
  EXPECT_EQ(none.quality, "");
  for (const auto& [section, key, value] : quality_options("standard"))
    EXPECT_EQ(none.options.at(section).list.find(key)->get(),
              standard.options.at(section).list.find(key)->get())
        << key;
}

TEST_F(RecipeTest, UnknownQualitiesAreToldTheKnown) {
  for (const std::string& name : quality_names()) {
    EXPECT_THAT(error("quality: best\n"), HasSubstr(name));
    EXPECT_THAT(error("", {"quality=best"}), HasSubstr(name));
  }
  EXPECT_THAT(error("quality: best\n"), HasSubstr("recipe.yaml:2: quality is \"best\""));
}

TEST_F(RecipeTest, OtherDocumentsAreNoRecipes) {
  const auto plain_error = [&](const std::string& text) {
    return message_of(ExitCode::bad_recipe, [&] { recipe_from(folder_.path(), text); });
  };
  EXPECT_THAT(plain_error("just some text\n"), HasSubstr("is not a recipe"));
  EXPECT_THAT(plain_error(""), HasSubstr("is not a recipe"));
  EXPECT_THAT(plain_error("name: x\n"), HasSubstr("lacks the key 'schema'"));
  EXPECT_THAT(plain_error("schema: organbake/recipe/2\n"), HasSubstr("organbake/recipe/1"));
  EXPECT_THROW(read_recipe(folder_.path() / "missing.yaml", {}), NoInputError);
}

TEST_F(RecipeTest, TheSchemaHoldsASectionForEveryStage) {
  const nlohmann::json schema = recipe_schema();
  for (const Stage& stage : all_stages()) {
    EXPECT_TRUE(schema["properties"].contains(stage.name)) << stage.name;
  }
}

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
  EXPECT_THAT(message_of(ExitCode::bad_recipe, [&] { plan(""); }), HasSubstr("--set ct=PATH"));
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
