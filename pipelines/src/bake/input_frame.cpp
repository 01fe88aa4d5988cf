// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/input_frame.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/pipelines/options_json.h"

namespace organbake {
namespace {

using Json = nlohmann::json;

struct Said {
  std::string key;  // "inputs.unit"
  Json value;
  std::string where;
};

// "auto" says nothing.
std::optional<Said> said_in(const Document& recipe, const std::string& section,
                            const std::string& key) {
  const Json& json = recipe.json();
  if (!json.contains(section) || !json[section].is_object()) return std::nullopt;
  const Json value = json[section].value(key, Json());
  if (value.is_null() || value == "auto") return std::nullopt;
  return Said{section + "." + key, value, recipe.location("/" + section + "/" + key)};
}

void check_alike(const std::string& key, const Said& first, const Said& second) {
  if (first.value == second.value) return;
  throw RecipeError(second.where + ": " + second.key + " is " + second.value.dump() + ", but " +
                    first.key + " is " + first.value.dump() + "; the input has one " + key +
                    ", which holds for all stages: say it once, as " + key +
                    " under inputs (--set " + key + "=…)");
}

const OptionList& options_of_a_reader() {
  static const StageOptions options = [] {
    for (const Stage& stage : all_stages())
      if (StageOptions own = stage.make_options(); reads_meshes(own.list)) return own;
    return StageOptions();
  }();
  return options.list;
}

}  // namespace

const std::vector<std::string>& input_frame_keys() {
  static const std::vector<std::string> keys = {"unit", "space"};
  return keys;
}

bool is_input_frame_key(const std::string& key) {
  const auto& keys = input_frame_keys();
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

bool reads_meshes(const OptionList& options) { return options.find("space") != nullptr; }

OptionValue parse_input_frame(const std::string& key, const std::string& text,
                              const std::string& where) {
  return parse_option(*options_of_a_reader().find(key), text, where);
}

Json input_frame_schema(const std::string& key) {
  return options_schema(options_of_a_reader())["properties"][key];
}

void apply_input_frame(const Document& recipe, std::map<std::string, StageOptions>& sections) {
  for (const std::string& key : input_frame_keys()) {
    const std::optional<Said> of_inputs = said_in(recipe, "inputs", key);
    std::optional<Said> of_meshes = of_inputs;
    for (const auto& [name, section] : sections) {
      if (!reads_meshes(section.list)) continue;
      const std::optional<Said> own = said_in(recipe, name, key);
      if (own && of_meshes) check_alike(key, *of_meshes, *own);
      if (own) of_meshes = own;
    }
    for (auto& [name, section] : sections) {
      // The lengths of a calibration, say, may have a unit of their own.
      const bool mesh = reads_meshes(section.list);
      const std::optional<Said>& said = mesh ? of_meshes : of_inputs;
      if (!said || !section.list.find(key) || (!mesh && said_in(recipe, name, key))) continue;
      set_from_json(section.list, {{key, said->value}}, "inputs.");
    }
  }
}

}  // namespace organbake
