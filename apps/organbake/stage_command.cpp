// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/text.h"
#include "organbake/commands.h"
#include "pipelines/outputs.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct StageFlags {
  fs::path output, cache;
  bool force = false;
  std::map<std::string, fs::path> inputs;
};

OptionList flag_list(const Stage& stage, const StageOptions& options, StageFlags& flags) {
  OptionList list;
  list.add(
      "output", &flags.output,
      {.help = std::string("-o: the ") + (stage.single_file ? "file" : "folder") + " to write"});
  for (const StageInput& input : stage.inputs) {
    list.add(input.name, &flags.inputs[input.name], {.help = input.help});
  }
  list.append(options.list);
  list.add("force", &flags.force, {.help = "run, whatever the cache holds"})
      .add("cache", &flags.cache, {.help = "folder of the cache"});
  return list;
}

std::string usage_of(const Stage& stage) {
  std::string usage = stage.name;
  for (const StageInput& input : stage.inputs) {
    std::string name = input.name;
    std::transform(name.begin(), name.end(), name.begin(), ::toupper);
    const bool optional = !input.required || !input.unless.empty();
    usage += optional ? " [" + name + "]" : " " + name;
  }
  return usage + (stage.single_file ? " -o FILE" : " -o DIR") + " [OPTIONS]";
}

// Inputs come as words in their order, or by name ("--proxy proxy.ply").
std::map<std::string, fs::path> inputs_from(const Stage& stage,
                                            const std::vector<std::string>& words,
                                            const StageFlags& flags) {
  std::map<std::string, fs::path> inputs;
  auto word = words.begin();
  for (const StageInput& input : stage.inputs) {
    const fs::path& named = flags.inputs.at(input.name);
    if (!named.empty()) {
      inputs[input.name] = named;
    } else if (word != words.end()) {
      inputs[input.name] = *word++;
    }
  }
  if (word != words.end()) {
    throw UsageError("'" + *word + "' is one input too many; usage: organbake " + usage_of(stage));
  }
  return inputs;
}

}  // namespace

int run_stage_command(const Stage& stage, const Arguments& arguments, Session& session) {
  const StageOptions options = stage.make_options();
  StageFlags flags;
  const auto words =
      session.read_command(arguments, usage_of(stage), "Stage " + stage.name + ": " + stage.summary,
                           flag_list(stage, options, flags), stage.inputs.size());
  if (!words) return 0;
  if (flags.output.empty()) throw UsageError("-o is missing: where shall the result go?");
  const Plan plan = plan_stage(stage, options.list, inputs_from(stage, *words, flags));
  check_stage_target(stage, flags.output);

  Runner runner = session.runner(flags.cache);
  std::vector<StepResult> results = runner.run(plan, {.force = flags.force});
  runner.ensure_sound(results, 0);
  write_stage_outputs(results.front(), flags.output);

  const StepResult& result = results.front();
  session.terminal().log(
      LogLevel::info,
      stage.name + ": " + (result.ran ? "ran in " + to_text(result.seconds, 2) + " s" : "cached"));
  nlohmann::json json = {{"output", flags.output.string()},
                         {"state", result.ran ? "ran" : "cached"},
                         {"report", nlohmann::json::parse(result.entry.report_json)}};
  session.print_result(flags.output.string(), json);
  if (json["report"].contains("bad_data")) {
    throw BadDataError(json["report"]["bad_data"].get<std::string>());
  }
  return 0;
}

}  // namespace organbake
