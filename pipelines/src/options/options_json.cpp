// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/options_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"

namespace organbake {
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
  if (option.traits.min) schema["minimum"] = number_json(*option.traits.min);
  if (option.traits.max) schema["maximum"] = number_json(*option.traits.max);
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

}  // namespace organbake
