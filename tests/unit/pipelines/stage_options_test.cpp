// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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

TEST(StageOptions, SurviveTheWayThroughAModulesDoor) {
  PlaceStageOptions options;
  options.placement.count = 5;
  options.cone_axis = {0.1, 0.2, -0.3};
  options.cone_angle_rad = 0.7;
  OptionList list;
  bind(list, options);
  const auto back = resolved_options<PlaceStageOptions>(to_json(list).dump());
  EXPECT_EQ(back.placement.count, 5);
  EXPECT_EQ(back.cone_axis, options.cone_axis);
  ASSERT_TRUE(back.resolved().cone);
  EXPECT_EQ(back.resolved().cone->half_angle_rad, 0.7);
  EXPECT_FALSE(PlaceStageOptions().resolved().cone) << "no cone unless it is asked for";
}

}  // namespace
}  // namespace organbake
