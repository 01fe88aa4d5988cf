// SPDX-License-Identifier: GPL-3.0-or-later
// What the front program and every stage's module share: the list of stages, options as JSON and as
// schemas, how one stage's module is loaded and run, and how much memory the machine has.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/processes.h"
#include "organbake/pipelines/stage.h"
#include "stage_descriptions.h"  // every stage's options.h; CMake writes it
#include "stages/inspect/options.h"

namespace organbake {

std::string input_of_many(const StageInput& input, std::size_t index,
                          const std::filesystem::path& path) {
  constexpr std::size_t kDigits = 4;  // names sort as they were given
  return input.name + " " + padded(index, kDigits) + " " + path.filename().string();
}

const std::vector<Stage>& all_stages() {
  static const std::vector<Stage> stages = {
#define STAGE(name) name##_stage(),
#include "stages/list.def"
#undef STAGE
  };
  return stages;
}

StageOptions inspect_options() { return make_options<InspectStageOptions>(); }

const Stage* find_stage(const std::string& name) {
  for (const Stage& stage : all_stages()) {
    if (stage.name == name) return &stage;
  }
  return nullptr;
}

namespace {

using Json = nlohmann::json;

// Whole numbers are written without ".0": sizes stay integers in every document.
Json number_json(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  if (value == std::floor(value) && std::abs(value) < kExactIntegers) {
    return static_cast<std::int64_t>(value);
  }
  return value;
}

std::optional<OptionValue> from_json(OptionKind kind, const Json& json) {
  switch (kind) {
    case OptionKind::boolean:
      if (json.is_boolean()) return json.get<bool>();
      break;
    case OptionKind::integer:
      if (json.is_number_integer()) return json.get<std::int64_t>();
      break;
    case OptionKind::number:
      if (json.is_number()) return json.get<double>();
      break;
    case OptionKind::number_or_auto:
      if (json.is_number()) return json.get<double>();
      if (json == "auto") return json.get<std::string>();
      break;
    case OptionKind::vector:
    case OptionKind::integers:
      if (json.is_array() && json.size() == 3 &&
          std::all_of(json.begin(), json.end(), [](const Json& v) { return v.is_number(); })) {
        return json.get<std::vector<double>>();
      }
      break;
    case OptionKind::texts:
      if (json.is_array()) return json.get<std::vector<std::string>>();
      break;
    case OptionKind::choice:
      if (json.is_boolean()) return json.dump();  // of what was a switch once
      if (json.is_string()) return json.get<std::string>();
      break;
    case OptionKind::text:
      if (json.is_number_integer()) return json.dump();  // the schema says where that may be
      [[fallthrough]];
    default:
      if (json.is_string()) return json.get<std::string>();
  }
  return std::nullopt;
}

Json number_schema(const Option& option, const char* type) {
  Json schema = {{"type", type}};
  const auto& [min, max] = option.traits.range;
  if (min) schema["minimum"] = number_json(*min);
  if (max) schema["maximum"] = number_json(*max);
  return schema;
}

Json array_schema(Json items) {
  return {{"type", "array"}, {"items", std::move(items)}, {"minItems", 3}, {"maxItems", 3}};
}

// Among the words true and false are meant as a switch gives them, too.
Json choice_schema(const std::vector<std::string>& choices) {
  if (std::find(choices.begin(), choices.end(), "true") == choices.end())
    return {{"type", "string"}, {"enum", choices}};
  Json words = choices;
  for (const bool on : {true, false}) words.push_back(on);
  return {{"enum", words}};
}

Json value_schema(const Option& option) {
  switch (option.kind) {
    case OptionKind::boolean:
      return {{"type", "boolean"}};
    case OptionKind::integer:
      return number_schema(option, "integer");
    case OptionKind::number:
      return number_schema(option, "number");
    case OptionKind::number_or_auto:
      return {{"anyOf", {number_schema(option, "number"), {{"const", "auto"}}}}};
    case OptionKind::vector:
      return array_schema(number_schema(option, "number"));
    case OptionKind::integers:
      return array_schema(number_schema(option, "integer"));
    case OptionKind::choice:
      return choice_schema(option.traits.choices);
    case OptionKind::texts:
      return {{"type", "array"}, {"items", {{"type", "string"}}}};
    case OptionKind::text:
      if (option.traits.number_too) {
        return {{"anyOf", {number_schema(option, "integer"), {{"type", "string"}}}}};
      }
      [[fallthrough]];
    default:
      return {{"type", "string"}};
  }
}

}  // namespace

Json to_json(const OptionValue& value) {
  if (const auto* number = std::get_if<double>(&value)) return number_json(*number);
  if (const auto* vector = std::get_if<std::vector<double>>(&value)) {
    Json array = Json::array();
    for (double component : *vector) array.push_back(number_json(component));
    return array;
  }
  return std::visit([](const auto& plain) { return Json(plain); }, value);
}

Json to_json(const OptionList& options) {
  Json object = Json::object();
  for (const Option& option : options.all()) object[option.name] = to_json(option.get());
  return object;
}

void set_from_json(const OptionList& options, const Json& object, const std::string& where) {
  for (const auto& [key, json] : object.items()) {
    const Option* option = options.find(key);
    if (!option) throw UsageError(where + key + ": there is no such option");
    const auto value = from_json(option->kind, json);
    if (!value) throw UsageError(where + key + ": " + json.dump() + " is of the wrong kind");
    check_option(*option, *value, where + key);
    option->set(*value);
  }
}

Json options_schema(const OptionList& options) {
  Json properties = Json::object();
  for (const Option& option : options.all()) {
    Json schema = value_schema(option);
    const std::string& unit = option.traits.unit;
    schema["description"] = option.traits.help + (unit.empty() ? "" : " [" + unit + "]");
    schema["default"] = to_json(option.default_value);
    properties[option.name] = std::move(schema);
  }
  return {{"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
}

std::filesystem::path module_file(const std::string& stage) {
  return module_folder() / ("stage_" + stage + ".so");
}

StageReport run_in_module(const Stage& stage, const StageCall& call) {
  const std::string module = "stage_" + stage.name;
  const std::string version =
      reinterpret_cast<const char* (*)()>(module_door(module, "organbake_stage_version"))();
  if (version != kVersion)
    throw Error(ExitCode::internal, module_file(stage.name).string() + ": is of version " +
                                        version + ", not " + kVersion +
                                        "; the installation is incomplete");
  const auto run = reinterpret_cast<void (*)(const StageCall&, StageReport&)>(
      module_door(module, "organbake_stage_run"));
  StageReport report;
  run(call, report);
  return report;
}

namespace {

constexpr double kBytesPerMegabyte = 1024.0 * 1024.0;
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

double meminfo_mb(const std::string& key) {
  constexpr double kKbPerMb = 1024;
  const auto kb = number_behind(key + ":", "/proc/meminfo");
  return kb ? *kb / kKbPerMb : kNoLimit;
}

// A control group's file of one number of bytes, or "max".
double group_mb(const std::string& path, double otherwise) {
  std::ifstream file(path);
  double bytes = 0;
  return file >> bytes ? bytes / kBytesPerMegabyte : otherwise;
}

// Without what is kept of files that were read: it is given back when asked for.
double group_used_mb(const std::string& folder) {
  const double cached = number_behind("inactive_file", folder + "/memory.stat").value_or(0);
  return group_mb(folder + "/memory.current", 0) - cached / kBytesPerMegabyte;
}

// The folder of this process' group (cgroup v2: a line "0::/path").
std::string group_folder() {
  std::ifstream file("/proc/self/cgroup");
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with("0::")) return "/sys/fs/cgroup" + line.substr(3);
  }
  return {};
}

}  // namespace

MachineMemory machine_memory() {
  MachineMemory memory{meminfo_mb("MemTotal"), meminfo_mb("MemAvailable")};
  // Every group above this one may limit it, too.
  for (std::string folder = group_folder(); folder.size() > 1;
       folder.resize(folder.find_last_of('/'))) {
    const double limit = group_mb(folder + "/memory.max", kNoLimit);
    memory.total_mb = std::min(memory.total_mb, limit);
    memory.available_mb = std::min(memory.available_mb, limit - group_used_mb(folder));
  }
  constexpr double kLeast_mb = 1;  // none left is not "no limit"
  memory.available_mb = std::max(memory.available_mb, kLeast_mb);
  return memory;
}

}  // namespace organbake
