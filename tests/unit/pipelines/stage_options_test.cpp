// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "organbake/core/error.h"
#include "organbake/pipelines/stage_binding.h"
#include "stages/place/options.h"

namespace organbake {
namespace {

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

// The unit's ending, and what a user of an option's name without it means.
TEST(StageOptions, NamesEndInTheirUnitAndAreTakenWithoutIt) {
  for (const Stage& stage : all_stages()) {
    const StageOptions options = stage.make_options();
    for (const Option& option : options.list.all()) {
      const std::string& unit = option.traits.unit;
      const std::string name = stage.name + "." + option.name;
      EXPECT_NE(unit, "rad") << name << ": users write degrees";
      if (unit.empty() || option.name == "iso" || option.name.ends_with("_mm_per_pixel")) continue;
      const std::string former = option.former_name();
      ASSERT_FALSE(former.empty()) << name << " does not end in its unit, " << unit;
      EXPECT_EQ(options.list.find(former), nullptr) << name << ": its former name is another's";
      EXPECT_EQ(options.list.find_former(former)->name, option.name);
    }
  }
}

TEST(StageOptions, AnAngleUnderItsFormerNameStaysInRadians) {
  const StageOptions options = options_from(PlaceStageOptions());
  const auto set = [&](const char* former, const std::string& text) {
    const Option* option = options.list.find_former(former);
    option->set(parse_former_option(*option, text, former));
    return *static_cast<const PlaceStageOptions*>(options.storage.get());
  };
  EXPECT_EQ(set("field_of_view", "0.35").placement.field_of_view_rad, 0.35);
  EXPECT_EQ(set("texel", "0.35").goal.texel_mm, 0.35);
  constexpr double kRounded = 1e-3;  // 1.571 was written for a hemisphere
  EXPECT_NEAR(set("cone_angle", "1.571").cone_angle_rad, std::numbers::pi / 2, kRounded);
  EXPECT_THROW(set("cone_angle", "70"), UsageError) << "degrees under the former name";
  const Option* option = options.list.find("field_of_view_deg");
  option->set(parse_option(*option, "45", ""));
  EXPECT_NEAR(set("texel", "1").placement.field_of_view_rad, std::numbers::pi / 4, 1e-15);
}

TEST(StageOptions, ARetiredSettingIsKnownByBothItsSpellingsAndIsNoOption) {
  const StageOptions options = find_stage("shade")->make_options();
  EXPECT_EQ(options.list.find("full_relief"), nullptr);
  EXPECT_FALSE(options.list.retired_note("full_relief").empty());
  EXPECT_EQ(options.list.retired_note("full-relief"), options.list.retired_note("full_relief"));
  EXPECT_TRUE(options.list.retired_note("texture").empty());
}

}  // namespace
}  // namespace organbake
