// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/recipe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "fake_stages.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/pipelines/quality.h"

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
    try {
      read(body, settings);
    } catch (const RecipeError& error) {
      return error.what();
    }
    return "it was accepted";
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
    try {
      read_recipe(folder_.path() / name, {});
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string("it was taken for a recipe");
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
  EXPECT_THAT(
      error("place: {field_of_view: 70}\n"),
      HasSubstr("recipe.yaml:2: field_of_view (in radians, as field_of_view_deg was once)"));
  EXPECT_THAT(error("", {"place.field_of_view=70"}), HasSubstr("as field_of_view_deg was once"));
  EXPECT_THAT(error("place: {texel: 2, texel_mm: 3}\n"), HasSubstr("are one option"));
  EXPECT_THAT(error("decimate: 80\n"), HasSubstr("decimate is 80; it must be a group of keys"));
}

TEST_F(RecipeTest, NamesWithoutTheirUnitAreTakenWithANote) {
  const Recipe recipe = read("place: {texel: 2, cone_angle: 0.7}\nshade: {light: '0.5,0.7'}\n",
                             {"place.field_of_view=0.35"});
  const auto value = [&](const char* stage, const char* name) {
    return recipe.options.at(stage).list.find(name)->get();
  };
  EXPECT_EQ(value("place", "texel_mm"), OptionValue(2.0));
  constexpr double kDegrees = 180 / std::numbers::pi, kRounding = 1e-12;
  EXPECT_NEAR(std::get<double>(value("place", "cone_angle_deg")), 0.7 * kDegrees, kRounding);
  EXPECT_NEAR(std::get<double>(value("place", "field_of_view_deg")), 0.35 * kDegrees, kRounding);
  EXPECT_THAT(std::get<std::string>(value("shade", "light_deg")), testing::StartsWith("28.64"));
  EXPECT_THAT(recipe.notes,
              testing::UnorderedElementsAre(
                  "place.texel is called texel_mm now",
                  "place.cone_angle, in radians, is called cone_angle_deg now, in degrees",
                  "place.field_of_view, in radians, is called field_of_view_deg now, in degrees",
                  "shade.light, in radians, is called light_deg now, in degrees"));
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
       {std::pair("shade: {full_relief: true, texture: 0.1}\n", ""),
        std::pair("shade: {texture: 0.1}\n", "shade.full-relief=true")}) {
    const Recipe recipe =
        read(text, *setting ? std::vector<std::string>{setting} : std::vector<std::string>{});
    EXPECT_EQ(recipe.options.at("shade").list.find("texture")->get(), OptionValue(0.1));
    EXPECT_THAT(
        recipe.notes,
        testing::ElementsAre(testing::StartsWith("shade.full_relief is no longer a setting: ")));
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
  const auto plain_error = [&](const std::string& text) -> std::string {
    try {
      recipe_from(folder_.path(), text);
    } catch (const RecipeError& error) {
      return error.what();
    }
    return "it was accepted";
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

}  // namespace
}  // namespace organbake
