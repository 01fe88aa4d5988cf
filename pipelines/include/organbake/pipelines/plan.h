// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// Where a step's input comes from: the user, or an earlier step of the plan.
struct InputSource {
  std::string name;
  InputKind kind = InputKind::mesh;
  std::filesystem::path given;  // empty: it is `file` of step `step`
  std::size_t step = 0;
  std::string file;
};

struct Step {
  const Stage* stage = nullptr;
  StageOptions options;
  std::string options_json;  // their canonical form
  std::vector<InputSource> inputs;
};

// Something that a recipe mentions or offers and that this bake does not use.
struct LeftOut {
  std::string what, why;
};

// Steps in running order. Only what the scene needs: a stage is there when something that it makes
// is asked for and not given.
struct Plan {
  std::vector<Step> steps;
  std::vector<LeftOut> left_out;
  bool of_recipe = false;  // not of a single stage
};

// All that a bundle needs, or (with `last_stage`) only what that stage needs, itself the last step.
// Throws RecipeError when an input is missing, UsageError for a last stage that doesn't run.
Plan plan_bake(const Recipe& recipe, const std::string& last_stage = "");

// One stage on its own. Throws UsageError when an input is missing.
Plan plan_stage(const Stage& stage, const StageOptions& options,
                const std::map<std::string, std::filesystem::path>& inputs);

}  // namespace organbake
