// SPDX-License-Identifier: GPL-3.0-or-later
// From a recipe to the steps that its scene needs, each with where its inputs come from.
#include "organbake/pipelines/runner.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "organbake/core/error.h"
#include "organbake/pipelines/options_json.h"
#include "recipe_inputs.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Inputs = std::map<std::string, fs::path>;

bool needed(const StageInput& input, const Inputs& given) {
  return input.required && !(!input.unless.empty() && given.contains(input.unless));
}

bool makes_any_of(const Stage& stage, const std::set<std::string>& wanted) {
  return std::any_of(stage.outputs.begin(), stage.outputs.end(),
                     [&](const StageOutput& output) { return wanted.contains(output.artifact); });
}

// Several stages can make a surface: the one that the user gives an input of is meant, else the one
// that the recipe has a section for.
enum class Claim { none, section, input };

// Whether a stage takes part at all.
bool is_open(const Stage& stage, const Recipe& recipe) {
  return !recipe.declined.contains(stage.name) &&
         (!stage.by_section_only || recipe.sections.contains(stage.name));
}

Claim claim_of(const Stage& stage, const Recipe& recipe) {
  if (!is_open(stage, recipe)) return Claim::none;
  const bool given =
      std::any_of(stage.inputs.begin(), stage.inputs.end(),
                  [&](const StageInput& input) { return recipe.inputs.contains(input.name); });
  if (given) return Claim::input;
  return recipe.sections.contains(stage.name) ? Claim::section : Claim::none;
}

bool prefers_another(const Recipe& recipe, const Stage& stage,
                     const std::set<std::string>& wanted) {
  const Claim own = claim_of(stage, recipe);
  // The phantom has nothing that could be given: its section is all that it can claim by.
  if (own != Claim::none && stage.inputs.empty()) return false;
  return std::any_of(all_stages().begin(), all_stages().end(), [&](const Stage& other) {
    return !other.inputs.empty() && claim_of(other, recipe) > own &&
           std::any_of(other.outputs.begin(), other.outputs.end(), [&](const StageOutput& output) {
             return wanted.contains(output.artifact) && stage.output(output.artifact);
           });
  });
}

// Goes back from what is wanted to what the user gives. A stage without inputs (the phantom) stands
// in for a user's data only when the recipe asks for it.
std::set<std::string> stages_needed(const Recipe& recipe, std::set<std::string> wanted) {
  std::set<std::string> running;
  for (const auto& [name, path] : recipe.inputs) wanted.erase(name);
  const auto& stages = all_stages();
  for (auto stage = stages.rbegin(); stage != stages.rend(); ++stage) {
    if (!is_open(*stage, recipe) || !makes_any_of(*stage, wanted)) continue;
    if (stage->inputs.empty() && !recipe.sections.contains(stage->name)) continue;
    if (prefers_another(recipe, *stage, wanted)) continue;
    running.insert(stage->name);
    for (const StageOutput& output : stage->outputs) wanted.erase(output.artifact);
    for (const StageInput& input : stage->inputs) {
      const bool asked = needed(input, recipe.inputs) || recipe.inputs.contains(input.made_from);
      if (asked && !recipe.inputs.contains(input.name)) {
        wanted.insert(input.name);
      }
    }
  }
  return running;
}

const StageOutput* find_output(const std::vector<Step>& steps, const std::string& artifact,
                               std::size_t& step) {
  // The latest that makes it: photographs that were registered stand before those that came posed.
  for (step = steps.size(); step-- > 0;) {
    if (const StageOutput* output = steps[step].stage->output(artifact)) return output;
  }
  return nullptr;
}

// False when the input is needed and neither given nor made by an earlier step.
bool connect(Step& step, const StageInput& input, const Inputs& given,
             const std::vector<Step>& earlier) {
  if (input.many) {
    for (const auto& [name, path] : given) {
      if (name.starts_with(input.name + " "))
        step.inputs.push_back({name, input.kind, path, 0, {}});
    }
    const bool any = !step.inputs.empty() && step.inputs.back().name.starts_with(input.name + " ");
    return any || !needed(input, given);
  }
  InputSource source{input.name, input.kind, {}, 0, {}};
  const auto path = given.find(input.name);
  if (path != given.end()) {
    if (path->second.empty()) throw UsageError("the path of '" + input.name + "' is empty");
    source.given = path->second;
  } else if (const StageOutput* output = find_output(earlier, input.name, source.step)) {
    source.file = output->file;
  } else {
    return !needed(input, given);
  }
  step.inputs.push_back(std::move(source));
  return true;
}

// The unit and the axes are those of the inputs: what stages make is in the world's own.
StageOptions options_of(const Step& step, const StageOptions& asked) {
  StageOptions options = asked.copy();
  const bool given = std::any_of(step.inputs.begin(), step.inputs.end(), [](const auto& input) {
    return input.kind == InputKind::mesh && !input.given.empty();
  });
  if (reads_meshes(options.list) && !given)
    for (const std::string& key : input_frame_keys())
      options.list.find(key)->set(std::string("auto"));
  return options;
}

std::string why_left_out(const Stage& stage, const Recipe& recipe,
                         const std::set<std::string>& running) {
  if (const auto found = recipe.declined.find(stage.name); found != recipe.declined.end())
    return found->second;
  for (const StageOutput& output : stage.outputs) {
    if (recipe.inputs.contains(output.artifact)) return "the " + output.artifact + " is given";
  }
  for (const char* input : {"surface", "mask"}) {
    if (recipe.inputs.contains(input)) return std::string("the ") + input + " is given";
  }
  for (const std::string& name : running) {
    for (const StageOutput& output : stage.outputs)
      if (find_stage(name)->output(output.artifact))
        return "the " + output.artifact + " is made by " + name;
  }
  return "nothing that it makes is needed";
}

bool used(const std::vector<Step>& steps, const std::string& input) {
  for (const Step& step : steps) {
    for (const InputSource& source : step.inputs) {
      if (source.name == input) return true;
    }
  }
  return false;
}

// Whether a step was told the unit, or the axes, of what it reads.
bool says(const std::vector<Step>& steps, const std::string& key) {
  return std::any_of(steps.begin(), steps.end(), [&](const Step& step) {
    return nlohmann::json::parse(step.options_json).value(key, "auto") != "auto";
  });
}

std::vector<LeftOut> list_left_out(const Recipe& recipe, const Plan& plan,
                                   const std::set<std::string>& running) {
  std::vector<LeftOut> list;
  for (const Stage& stage : all_stages()) {
    const bool offered =
        recipe.sections.contains(stage.name) || !(stage.inputs.empty() || stage.on_request);
    if (offered && !running.contains(stage.name)) {
      list.push_back({stage.name, why_left_out(stage, recipe, running)});
    }
  }
  for (const auto& [name, path] : recipe.inputs) {
    if (!used(plan.steps, name)) list.push_back({"input " + name, "no step of this bake reads it"});
  }
  for (const auto& [option, value] : recipe.outranked) {
    list.push_back({option + " of quality " + recipe.quality, "the recipe says " + value});
  }
  return list;
}

// Whoever says the unit of a CT, say, would go on with a wrong one.
void check_input_frame(const Recipe& recipe, const Plan& plan) {
  for (const std::string& key : recipe.said_of_inputs) {
    if (says(plan.steps, key)) continue;
    throw RecipeError(key +
                      " is said of the inputs, but no step of this bake reads it: it is of a "
                      "surface that is given. A CT's or a mask's header says its own; correct that "
                      "where it is wrong, and leave " +
                      key + " out");
  }
}

}  // namespace

Plan plan_bake(const Recipe& recipe, const std::string& last_stage) {
  std::set<std::string> wanted = {"proxy", "mechanics", "cameras", "maps"};
  if (!last_stage.empty()) {
    const Stage* last = find_stage(last_stage);
    if (!last) throw UsageError("there is no stage '" + last_stage + "'");
    wanted = {last->outputs.front().artifact};
  }
  const std::set<std::string> running = stages_needed(recipe, wanted);
  if (!last_stage.empty() && !running.contains(last_stage)) {
    throw UsageError("the stage '" + last_stage + "' is not part of this bake: " +
                     why_left_out(*find_stage(last_stage), recipe, running));
  }
  Plan plan;
  plan.of_recipe = true;
  for (const Stage& stage : all_stages()) {
    if (!running.contains(stage.name)) continue;
    Step step{&stage, {}, {}, {}};
    for (const StageInput& input : stage.inputs) {
      if (connect(step, input, recipe.inputs, plan.steps)) continue;
      throw RecipeError("the stage '" + stage.name + "' lacks its input '" + input.name + "' (" +
                        input.help + "): write it under inputs, or give --set " + input.name +
                        "=PATH");
    }
    step.options = options_of(step, recipe.options.at(stage.name));
    step.options_json = to_json(step.options.list).dump();
    plan.steps.push_back(std::move(step));
  }
  if (!last_stage.empty()) return plan;
  if (recipe.declined.empty()) check_input_frame(recipe, plan);
  plan.left_out = list_left_out(recipe, plan, running);
  return plan;
}

Plan plan_stage(const Stage& stage, const StageOptions& options, const Inputs& inputs) {
  Step step{&stage, options, to_json(options.list).dump(), {}};
  for (const StageInput& input : stage.inputs) {
    if (!connect(step, input, inputs, {})) {
      throw UsageError("'organbake " + stage.name + "' lacks its input '" + input.name +
                       "': " + input.help);
    }
  }
  return {{std::move(step)}, {}};
}

}  // namespace organbake
