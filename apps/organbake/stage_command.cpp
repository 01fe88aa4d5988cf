// SPDX-License-Identifier: GPL-3.0-or-later
// A stage as a command, and as a module of 3D Slicer.
#include <algorithm>
#include <cctype>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/runner.h"
#include "organbake/pipelines/stage.h"

namespace organbake {
namespace {

std::string element(const std::string& name, const std::string& text, int depth) {
  return std::string(std::size_t(2 * depth), ' ') + "<" + name + ">" + escape_html(text) + "</" +
         name + ">\n";
}

// "photo_size" → "Photo size", as the panel shows it.
std::string label_of(std::string name, const std::string& unit = "") {
  std::replace(name.begin(), name.end(), '_', ' ');
  name.front() = char(std::toupper(static_cast<unsigned char>(name.front())));
  return unit.empty() ? name : name + " (" + unit + ")";
}

std::string capital(std::string text) {
  if (!text.empty()) text.front() = char(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

// One parameter: its tag with attributes, then what all have in the order of the schema.
struct Parameter {
  std::string tag = {}, attributes = {}, name = {}, flag = {}, description = {}, label = {};
  std::string default_text = {}, channel = {}, rest = {};

  std::string xml() const {
    std::string xml = "    <" + tag + attributes + ">\n" + element("name", name, 3) +
                      element("longflag", flag, 3) + element("description", description, 3) +
                      element("label", label, 3);
    if (!default_text.empty()) xml += element("default", default_text, 3);
    if (!channel.empty()) xml += element("channel", channel, 3);
    return xml + rest + "    </" + tag + ">\n";
  }
};

// ---- inputs and the output

std::string tag_of(InputKind kind) {
  if (kind == InputKind::mesh) return "geometry";
  return kind == InputKind::volume ? "image" : "file";
}

std::string attributes_of(const StageInput& input) {
  if (input.kind == InputKind::mesh)
    return " type=\"model\" fileExtensions=\".vtk,.ply,.stl,.obj\"";
  if (input.kind != InputKind::volume) return "";
  return input.name == "mask" ? " type=\"label\"" : " type=\"scalar\"";
}

std::string flag_of(const StageInput& input) {
  Option option;
  option.name = input.flag.empty() ? input.name : input.flag;
  return option.flag();
}

std::string input_xml(const StageInput& input) {
  return Parameter{.tag = tag_of(input.kind),
                   .attributes = attributes_of(input),
                   .name = input.name,
                   .flag = flag_of(input),
                   .description = capital(input.help),
                   .label = label_of(input.name),
                   .channel = "input"}
      .xml();
}

std::string output_xml(const Stage& stage) {
  Parameter output{.name = "output", .flag = "--output", .label = "Output", .channel = "output"};
  if (!stage.single_file) {
    output.tag = "directory";
    output.description = "The folder to write";
    return output.xml();
  }
  const std::string ending = lower_ending(stage.outputs.front().file);
  output.tag = ending == ".ply" ? "geometry" : "file";
  output.attributes =
      (ending == ".ply" ? " type=\"model\"" : std::string()) + " fileExtensions=\"" + ending + "\"";
  output.description = "The file to write";
  return output.xml();
}

// ---- options

std::string type_of(const Option& option) {
  switch (option.kind) {
    case OptionKind::boolean:
      return "boolean";
    case OptionKind::integer:
      return "integer";
    case OptionKind::number:
      return "double";
    case OptionKind::choice:
      return "string-enumeration";
    case OptionKind::path:
      return "file";
    case OptionKind::vector:
      return "double-vector";
    case OptionKind::integers:
      return "integer-vector";
    default:
      return "string";  // "auto" is no number to Slicer
  }
}

// Slicer's whole numbers have 32 bits.
std::string bound_text(double bound, bool whole) {
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  if (!whole) return to_text(bound);
  return std::to_string(std::int64_t(std::clamp(bound, -kLargest, kLargest)));
}

// The schema wants all three; without both bounds the panel has a plain field.
std::string constraints_of(const Option& option) {
  const bool whole = option.kind == OptionKind::integer || option.kind == OptionKind::integers;
  const bool number =
      whole || option.kind == OptionKind::number || option.kind == OptionKind::vector;
  const auto& [min, max] = option.traits.range;
  if (!number || !min || !max) return "";
  constexpr double kSteps = 1000;
  const double step = whole ? 1 : (*max - *min) / kSteps;
  return "      <constraints>\n" + element("minimum", bound_text(*min, whole), 4) +
         element("maximum", bound_text(*max, whole), 4) + element("step", to_text(step), 4) +
         "      </constraints>\n";
}

std::string option_xml(const Option& option) {
  Parameter parameter{.tag = type_of(option),
                      .name = option.name,
                      .flag = option.flag(),
                      .description = capital(option.traits.help),
                      .label = label_of(option.name, option.traits.unit),
                      .default_text = option_text(option.default_value),
                      .rest = constraints_of(option)};
  const bool* on = std::get_if<bool>(&option.default_value);
  if (on && *on) {
    // Slicer names a switch or leaves it out, so that one which is on needs its opposite.
    parameter.name = "no_" + option.name;
    parameter.flag = "--no-" + option.flag().substr(2);
    parameter.label = "Not: " + label_of(option.name);
    parameter.description = "Turns off: " + option.traits.help;
    parameter.default_text = "false";
  }
  for (const std::string& choice : option.traits.choices)
    parameter.rest += element("element", choice, 3);
  return parameter.xml();
}

std::string group(const std::string& label, const std::string& description,
                  const std::string& parameters) {
  if (parameters.empty()) return "";
  return "  <parameters>\n" + element("label", label, 2) + element("description", description, 2) +
         parameters + "  </parameters>\n";
}

// A stage as 3D Slicer's execution model describes a command-line module (XML): inputs and the
// output as Slicer's own nodes where it has any, else as files, and every option with its range and
// default. Options are passed by their long flags.
std::string slicer_module(const Stage& stage, const OptionList& options) {
  std::string files, settings;
  for (const StageInput& input : stage.inputs) files += input_xml(input);
  files += output_xml(stage);
  for (const Option& option : options.all()) settings += option_xml(option);
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n" +
         element("category", "Organbake", 1) + element("title", label_of(stage.name), 1) +
         element("description", capital(stage.summary) + ".", 1) + element("version", kVersion, 1) +
         element("documentation-url", "file:///usr/share/doc/organbake/html/slicer.html", 1) +
         element("license", "GPL-3.0-or-later", 1) +
         element("contributor", "The authors of organbake", 1) +
         group("Files", "What it reads and writes", files) +
         group("Options", "How it works", settings) + "</executable>\n";
}

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
