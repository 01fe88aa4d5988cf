// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/output_lock.h"
#include "organbake/pipelines/outputs.h"
#include "slicer_module.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct StageFlags {
  fs::path output, cache;
  bool force = false, xml = false, strict = false;
  std::map<std::string, fs::path> inputs;
};

OptionList flag_list(const Stage& stage, const StageOptions& options, StageFlags& flags) {
  OptionList list;
  list.add("output", &flags.output,
           {.help = std::string("the ") + (stage.single_file ? "file" : "folder") + " to write",
            .value = stage.single_file ? "FILE" : "DIR",
            .short_flag = "-o"});
  for (const StageInput& input : stage.inputs) {
    list.add(input.flag.empty() ? input.name : input.flag, &flags.inputs[input.name],
             {.help = input.help});
  }
  list.append(options.list);
  // Stages that read scans or clips have their own, which says what they are strict about.
  if (!options.list.find("strict"))
    list.add("strict", &flags.strict,
             {.help = "end with exit code 3 when there was a warning; the result is written"});
  list.add("force", &flags.force, {.help = "run, whatever the cache holds"})
      .add("cache", &flags.cache, {.help = "folder of the cache", .value = "DIR"})
      .add("xml", &flags.xml, {.help = "print the description that 3D Slicer makes a panel from"});
  return list;
}

// Of many inputs of one name all words are taken; what comes after them has a flag only.
bool is_word(const Stage& stage, const StageInput& asked) {
  for (const StageInput& input : stage.inputs) {
    if (input.name == asked.name) return true;
    if (input.many) return false;
  }
  return false;
}

std::string usage_of(const Stage& stage) {
  std::string usage = stage.name;
  for (const StageInput& input : stage.inputs) {
    std::string name = input.name;
    std::transform(name.begin(), name.end(), name.begin(), ::toupper);
    const bool optional = !input.required || (!input.unless.empty() && !input.many);
    if (is_word(stage, input)) usage += optional ? " [" + name + "]" : " " + name;
    if (input.many) usage += " [" + name + "…]";
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
    if (input.many) {
      if (!named.empty()) inputs[input_of_many(input, 0, named)] = named;
      for (std::size_t i = 1; word != words.end(); ++i, ++word)
        inputs[input_of_many(input, i, *word)] = *word;
    } else if (!named.empty()) {
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

std::size_t most_words(const Stage& stage) {
  constexpr std::size_t kMany = 4096;
  for (const StageInput& input : stage.inputs) {
    if (input.many) return kMany;
  }
  return stage.inputs.size();
}

// The result is there, but the stage may say that its input was damaged or that it is not good
// enough. Throws BadDataError.
int exit_code_of(const nlohmann::json& report, bool strictly_bad) {
  const auto damage = report.find("bad_data");
  if (damage != report.end()) throw BadDataError(damage->get<std::string>());
  return static_cast<int>(strictly_bad || report.contains("quality_gate") ? ExitCode::quality_gate
                                                                          : ExitCode::ok);
}

// With --each-label one file becomes a folder of them, whose names only the run knows.
Stage as_asked(const Stage& stage, const OptionList& options) {
  Stage asked = stage;
  const Option* each = options.find("each_label");
  if (each && std::get<bool>(each->get())) {
    asked.single_file = false;
    asked.outputs = {{"surfaces", "."}};
  }
  return asked;
}

}  // namespace

int run_stage_command(const Stage& described, const Arguments& arguments, Session& session) {
  const StageOptions options = described.make_options();
  StageFlags flags;
  const auto words = session.read_command(
      arguments, usage_of(described), "Stage " + described.name + ": " + described.summary,
      flag_list(described, options, flags), most_words(described));
  if (!words) return 0;
  if (flags.xml) {
    write_to_stdout(slicer_module(described, options.list));
    return 0;
  }
  const Stage stage = as_asked(described, options.list);
  if (flags.output.empty()) throw UsageError("-o is missing: where shall the result go?");
  const Plan plan = plan_stage(stage, options, inputs_from(stage, *words, flags));
  check_stage_target(stage, flags.output);

  Runner runner = session.runner(flags.cache);
  std::vector<StepResult> results = runner.run(plan, {.force = flags.force});
  if (const std::string why = results.front().declined(); !why.empty())
    throw BadDataError(stage.name + ": " + why);
  runner.ensure_sound(results, 0);
  {
    const FileLock lock(output_lock(flags.output), session.context(stage.name));
    write_stage_outputs(results.front(), flags.output);
  }

  const StepResult& result = results.front();
  session.terminal().log(
      LogLevel::info,
      stage.name + ": " +
          (result.ran ? "ran in " + to_text(result.entry.record.seconds, 2) + " s" : "cached"));
  const nlohmann::json report = nlohmann::json::parse(result.entry.record.report_json);
  const nlohmann::json json = {{"output", flags.output.string()},
                               {"state", result.ran ? "ran" : "cached"},
                               {"warnings", warnings_of(results)},
                               {"report", report}};
  session.print_result(flags.output.string(), json);
  return exit_code_of(report, flags.strict && !result.warnings.empty());
}

}  // namespace organbake
