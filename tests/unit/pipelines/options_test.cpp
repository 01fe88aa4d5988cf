// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/options/options.h"

#include "organbake/core/error.h"
#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/stage.h"
#include "stages/place/options.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

enum class Fruit { apple, pear };

struct Everything {
  bool ripe = true;
  int count = 3;
  std::size_t many = 7;
  double length_mm = 0.25;
  float share = 0.42f;
  std::string word = "red";
  Fruit fruit = Fruit::apple;
  Eigen::Vector3d axis = {0, -1, 0.5};
  std::array<int, 3> size = {1, 2, 3};
  std::filesystem::path file = "a/b";
};

OptionList bound(Everything& all) {
  OptionList list;
  list.add("ripe", &all.ripe, {.help = "or not"})
      .add("count", &all.count, {.help = "of them", .range = {1, 9}})
      .add("many", &all.many, {.help = "more of them"})
      .add("length", &all.length_mm, {.help = "of one", .unit = "mm", .range = {.min = 0}})
      .add("share", &all.share, {.help = "part", .range = {0, 1}})
      .add("word", &all.word, {.help = "colour", .choices = {"red", "green"}})
      .add("fruit", &all.fruit, {.help = "kind"}, {{"apple", Fruit::apple}, {"pear", Fruit::pear}})
      .add("axis", &all.axis, {.help = "way"})
      .add("two_words", &all.size, {.help = "of a box", .range = {.min = 1}})
      .add("file", &all.file, {.help = "somewhere"});
  return list;
}

const Option& option(const OptionList& list, const std::string& name) { return *list.find(name); }

void set(const OptionList& list, const std::string& name, const std::string& text) {
  option(list, name).set(parse_option(option(list, name), text, "--" + name));
}

std::string refusal(const OptionList& list, const std::string& name, const std::string& text) {
  return message_of(ExitCode::usage, [&] { set(list, name, text); });
}

TEST(Options, ARefusalTellsWhatMayHaveBeenMeant) {
  double share = 0.5;
  std::string word = "red";
  OptionList list;
  list.add("share", &share, {.help = "part", .range = {0, 1}})
      .add("word", &word, {.help = "colour", .choices = {"red", "green"}});
  EXPECT_THAT(refusal(list, "share", "0,5"),
              testing::HasSubstr("decimals stand behind a point: 0.5"));
  EXPECT_THAT(refusal(list, "word", "Gren"), testing::HasSubstr("did you mean 'green'?"));
}

TEST(Options, TheDefaultsAreTheVariablesValues) {
  Everything all;
  const OptionList list = bound(all);
  EXPECT_EQ(std::get<std::int64_t>(option(list, "count").default_value), 3);
  EXPECT_EQ(std::get<std::string>(option(list, "fruit").default_value), "apple");
  for (const Option& each : list.all()) {
    EXPECT_NO_THROW(check_option(each, each.default_value, each.name)) << each.name;
  }
}

TEST(Options, TextReachesTheVariables) {
  Everything all;
  const OptionList list = bound(all);
  set(list, "ripe", "false");
  set(list, "count", "9");
  set(list, "many", "18");
  set(list, "length", "1e-3");
  set(list, "fruit", "pear");
  set(list, "axis", "1,-2.5,0");
  set(list, "two-words", "4,5,6");
  set(list, "file", "c d");
  EXPECT_FALSE(all.ripe);
  EXPECT_EQ(all.count, 9);
  EXPECT_EQ(all.many, 18u);
  EXPECT_EQ(all.length_mm, 1e-3);
  EXPECT_EQ(all.fruit, Fruit::pear);
  EXPECT_EQ(all.axis, Eigen::Vector3d(1, -2.5, 0));
  EXPECT_EQ(all.size, (std::array<int, 3>{4, 5, 6}));
  EXPECT_EQ(all.file, "c d");
}

TEST(Options, WhatIsNotAValueIsRefusedWithWhatIsExpected) {
  Everything all;
  const OptionList list = bound(all);
  const std::pair<const char*, const char*> wrong[] = {
      {"ripe", "maybe"},      {"count", "0"},           {"count", "10"},
      {"count", "3.5"},       {"count", "3x"},          {"count", ""},
      {"length", "-1"},       {"length", "nan"},        {"length", "inf"},
      {"share", "1.01"},      {"word", "blue"},         {"fruit", "plum"},
      {"axis", "1,2"},        {"axis", "1,2,3,4"},      {"axis", "1,2,nan"},
      {"two_words", "1,2,0"}, {"two_words", "1,2,3.5"}, {"count", "99999999999999999999"}};
  for (const auto& [name, text] : wrong) {
    EXPECT_THROW(set(list, name, text), UsageError) << name << "=" << text;
  }
  EXPECT_EQ(refusal(list, "count", "10"),
            "--count: '10' is not possible; it takes a whole number, 1…9");
}

TEST(Options, NamesTakeHyphensAndUnderlines) {
  Everything all;
  const OptionList list = bound(all);
  EXPECT_EQ(list.find("two-words"), list.find("two_words"));
  EXPECT_EQ(option(list, "two_words").flag(), "--two-words");
  EXPECT_EQ(list.find("twowords"), nullptr);
}

TEST(OptionsJson, GoesThereAndBack) {
  Everything all;
  const nlohmann::json json = to_json(bound(all));
  EXPECT_EQ(json.dump(),
            R"({"axis":[0,-1,0.5],"count":3,"file":"a/b","fruit":"apple","length":0.25,"many":7,)"
            R"("ripe":true,"share":0.42,"two_words":[1,2,3],"word":"red"})");
  Everything other;
  other.count = 1;
  other.share = 0;
  other.fruit = Fruit::pear;
  set_from_json(bound(other), json, "");
  EXPECT_EQ(to_json(bound(other)), json);
  EXPECT_EQ(other.share, 0.42f) << "a float comes back as the very same float";
}

TEST(OptionsJson, WrongDocumentsAreRefused) {
  Everything all;
  const OptionList list = bound(all);
  for (const char* text : {R"({"countt": 3})", R"({"count": "3"})", R"({"count": 3.5})",
                           R"({"count": 0})", R"({"axis": [1, 2]})", R"({"axis": [1, 2, "x"]})",
                           R"({"fruit": "plum"})", R"({"ripe": 1})"}) {
    EXPECT_THROW(set_from_json(list, nlohmann::json::parse(text), "x."), UsageError) << text;
  }
}

TEST(OptionsJson, TheSchemaSaysRangeUnitAndDefault) {
  Everything all;
  const nlohmann::json schema = options_schema(bound(all));
  EXPECT_EQ(schema["additionalProperties"], false);
  const nlohmann::json& count = schema["properties"]["count"];
  EXPECT_EQ(count["type"], "integer");
  EXPECT_EQ(count["minimum"], 1);
  EXPECT_EQ(count["maximum"], 9);
  EXPECT_EQ(count["default"], 3);
  EXPECT_EQ(schema["properties"]["length"]["description"], "of one [mm]");
  EXPECT_EQ(schema["properties"]["fruit"]["enum"], nlohmann::json({"apple", "pear"}));
}

TEST(StageOptions, TheDefaultsOfEveryStageAreValid) {
  for (const Stage& stage : all_stages()) {
    const StageOptions options = stage.make_options();
    for (const Option& option : options.list.all()) {
      EXPECT_NO_THROW(check_option(option, option.default_value, option.name))
          << stage.name << "." << option.name;
      EXPECT_FALSE(option.traits.help.empty()) << stage.name << "." << option.name;
    }
  }
}

TEST(StageOptions, NoOptionHidesAnInputOrASharedFlag) {
  for (const Stage& stage : all_stages()) {
    const StageOptions options = stage.make_options();
    for (const char* taken : {"output", "force", "cache", "threads", "json", "quiet", "verbose"}) {
      EXPECT_EQ(options.list.find(taken), nullptr) << stage.name;
    }
    for (const StageInput& input : stage.inputs) {
      EXPECT_EQ(options.list.find(input.name), nullptr) << stage.name << " " << input.name;
    }
  }
}

TEST(StageOptions, ACopyHasTheValuesAndItsOwnStruct) {
  PlaceStageOptions options;
  options.cone_axis = {0.1, 0.2, -0.3};
  options.cone_angle_rad = 0.7;
  const StageOptions first = options_from(options);
  const StageOptions copy = first.copy();
  first.list.find("count")->set(std::int64_t{5});
  const RunContext context;
  const auto& in =
      StageCall{first.storage.get(), {}, {}, {}, context}.options_as<PlaceStageOptions>();
  const auto& out =
      StageCall{copy.storage.get(), {}, {}, {}, context}.options_as<PlaceStageOptions>();
  EXPECT_EQ(in.placement.count, 5);
  EXPECT_EQ(out.placement.count, PlaceStageOptions().placement.count);
  EXPECT_EQ(out.cone_axis, options.cone_axis);
  ASSERT_TRUE(out.resolved().cone);
  EXPECT_EQ(out.resolved().cone->half_angle_rad, 0.7);
  EXPECT_FALSE(PlaceStageOptions().resolved().cone) << "no cone unless it is asked for";
}

// Of a unit that does not depend on the volume.
std::string ending_of(const std::string& unit) {
  static const std::map<std::string, std::string> kEndings = {{"kg/m³", "_kg_per_m3"},
                                                              {"mm²", "_mm2"},
                                                              {"1/s", "_per_s"},
                                                              {"mm, LPS", "_mm"},
                                                              {"Mbit/s", "_mbit_per_s"}};
  const auto found = kEndings.find(unit);
  if (found != kEndings.end()) return found->second;
  std::string ending = "_" + unit;
  std::transform(ending.begin(), ending.end(), ending.begin(), ::tolower);
  return ending;
}

TEST(StageOptions, NamesEndInTheirUnit) {
  for (const Stage& stage : all_stages()) {
    const StageOptions options = stage.make_options();
    for (const Option& option : options.list.all()) {
      const std::string& unit = option.traits.unit;
      const std::string name = stage.name + "." + option.name;
      EXPECT_NE(unit, "rad") << name << ": users write degrees";
      if (unit.empty() || option.name == "iso" || option.name.ends_with("_mm_per_pixel")) continue;
      EXPECT_TRUE(option.name.ends_with(ending_of(unit))) << name << " of " << unit;
    }
  }
}

TEST(StageOptions, ARetiredSettingIsKnownByBothItsSpellingsAndIsNoOption) {
  const StageOptions options = find_stage("shade")->make_options();
  EXPECT_EQ(options.list.find("from_previous"), nullptr);
  EXPECT_FALSE(options.list.retired_note("from_previous").empty());
  EXPECT_EQ(options.list.retired_note("from-previous"), options.list.retired_note("from_previous"));
  EXPECT_TRUE(options.list.was_switch("from_previous"));
  EXPECT_TRUE(options.list.retired_note("texture").empty());
}

TEST(BakeWords, OptionsAreNamedAsABakeTakesThem) {
  EXPECT_EQ(in_bake_words("isosurface", "42 % was left out; --largest 2 keeps one more, 0 all"),
            "42 % was left out; --set isosurface.largest=2 keeps one more, 0 all");
  EXPECT_EQ(in_bake_words("isosurface", "cut flat; --cap round closes it as organs end"),
            "cut flat; --set isosurface.cap=round closes it as organs end");
  EXPECT_EQ(in_bake_words("isosurface", "choose --iso inside it"),
            "choose --set isosurface.iso=… inside it");
  EXPECT_EQ(in_bake_words("place", "more cameras, or --coverage, show it"),
            "more cameras, or --set place.coverage=…, show it");
  EXPECT_EQ(in_bake_words("isosurface", "larger than --min-size-mm 5 mm (--label 2)."),
            "larger than --set isosurface.min_size_mm=5 mm (--set isosurface.label=2).");
}

TEST(BakeWords, TogglesAndInputs) {
  EXPECT_EQ(in_bake_words("isosurface", "--no-keep-volume"), "--set isosurface.keep_volume=false");
  EXPECT_EQ(in_bake_words("isosurface", "without --strict they are mended"),
            "without --set isosurface.strict=true they are mended");
  EXPECT_EQ(in_bake_words("isosurface", "give the mask (--mask FILE), too"),
            "give the mask (--set mask=FILE), too");
  EXPECT_EQ(in_bake_words("capture", "--exemplar a/b.png needs --exemplar-mm-per-pixel: the size"),
            "--set exemplar=a/b.png needs --set capture.exemplar_mm_per_pixel=…: the size");
}

TEST(BakeWords, WhatIsNoOptionOfTheStageStays) {
  for (const char* text : {"in centimetres (--unit cm; unit=cm)", "--set isosurface.largest=2",
                           "--repair auto mends it", "a -- b", "--", "x--largest 2", ""})
    EXPECT_EQ(in_bake_words("isosurface", text), text);
  EXPECT_EQ(in_bake_words("bundle", "--largest 2"), "--largest 2");
}

}  // namespace
}  // namespace organbake
