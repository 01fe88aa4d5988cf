// SPDX-License-Identifier: Apache-2.0
// Options bound to variables: how their values are read, checked and told.
#include "organbake/options/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {

bool NumberRange::holds(double value) const {
  return std::isfinite(value) && (!min || value >= *min) && (!max || value <= *max);
}

std::string meant_number(const NumberRange& range, std::string text) {
  if (std::count(text.begin(), text.end(), ',') != 1) return {};
  std::replace(text.begin(), text.end(), ',', '.');
  const auto value = number_in<double>(text);
  return value && range.holds(*value) ? "; decimals stand behind a point: " + to_text(*value)
                                      : std::string();
}

namespace {

bool same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return x == y || ((x == '-' || x == '_') && (y == '-' || y == '_'));
  });
}

// Whole numbers in full: "10000000" where to_text() has "1e+07".
std::string number_text(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  const bool whole = value == std::floor(value) && std::abs(value) < kExactIntegers;
  return whole ? std::to_string(static_cast<std::int64_t>(value)) : to_text(value);
}

std::string expected(const Option& option) {
  static constexpr const char* kNames[] = {"true or false",
                                           "a whole number",
                                           "a number",
                                           "auto or a number",
                                           "a text",
                                           "one word",
                                           "a path",
                                           "three numbers (x,y,z)",
                                           "three whole numbers (x,y,z)",
                                           "a list of texts"};
  std::string text = kNames[static_cast<int>(option.kind)];
  if (!option.traits.unit.empty()) text += " in " + option.traits.unit;
  const std::string range = option.range();
  return range.empty() ? text : text + ", " + range;
}

std::string meant_by(const Option& option, std::string_view text) {
  const bool one_number = option.kind == OptionKind::integer || option.kind == OptionKind::number ||
                          option.kind == OptionKind::number_or_auto;
  return one_number ? meant_number(option.traits.range, std::string(text)) : std::string();
}

[[noreturn]] void refuse(const Option& option, const std::string& where, std::string_view text) {
  // What was meant comes first: there may be forty choices.
  const std::string meant = suggestion(text, option.traits.choices);
  throw UsageError(where + ": '" + std::string(text) + "' is not possible" +
                   (meant.empty() ? "; it" : meant + " It") + " takes " + expected(option) +
                   meant_by(option, text));
}

// With a plus before it or none, and never "nan".
template <class T>
std::optional<T> whole_number(std::string_view text) {
  const auto value = number_in<T>(text.substr(text.starts_with('+') ? 1 : 0));
  return value && std::isfinite(static_cast<double>(*value)) ? value : std::nullopt;
}

std::optional<std::vector<double>> three_numbers(std::string_view text, bool whole) {
  std::vector<double> values;
  while (true) {
    const std::size_t comma = text.find(',');
    const auto value = whole_number<double>(text.substr(0, comma));
    if (!value || (whole && *value != std::floor(*value))) return std::nullopt;
    values.push_back(*value);
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  if (values.size() != 3) return std::nullopt;
  return values;
}

std::optional<bool> truth(std::string_view text) {
  if (text == "true" || text == "yes" || text == "on" || text == "1") return true;
  if (text == "false" || text == "no" || text == "off" || text == "0") return false;
  return std::nullopt;
}

template <class T>
std::optional<OptionValue> as_value(const std::optional<T>& parsed) {
  if (!parsed) return std::nullopt;
  return OptionValue(*parsed);
}

std::optional<OptionValue> parsed(OptionKind kind, std::string_view text) {
  switch (kind) {
    case OptionKind::boolean:
      return as_value(truth(text));
    case OptionKind::integer:
      return as_value(whole_number<std::int64_t>(text));
    case OptionKind::number:
      return as_value(whole_number<double>(text));
    case OptionKind::number_or_auto:
      if (text == "auto") return std::string(text);
      return as_value(whole_number<double>(text));
    case OptionKind::vector:
    case OptionKind::integers:
      return as_value(three_numbers(text, kind == OptionKind::integers));
    case OptionKind::texts:
      return OptionValue(std::vector<std::string>{std::string(text)});
    default:
      return OptionValue(std::string(text));
  }
}

bool allowed(const OptionTraits& traits, const OptionValue& value) {
  const NumberRange range = traits.range;
  if (const auto* number = std::get_if<double>(&value)) return range.holds(*number);
  if (const auto* integer = std::get_if<std::int64_t>(&value))
    return range.holds(static_cast<double>(*integer));
  if (const auto* vector = std::get_if<std::vector<double>>(&value)) {
    return vector->size() == 3 &&
           std::all_of(vector->begin(), vector->end(), [&](double v) { return range.holds(v); });
  }
  if (const auto* text = std::get_if<std::string>(&value); text && !traits.choices.empty())
    return std::find(traits.choices.begin(), traits.choices.end(), *text) != traits.choices.end();
  return true;
}

// The choice that differs in capitals alone, as RAS from ras; else the text.
std::string_view known_choice(const Option& option, std::string_view text) {
  for (const std::string& choice : option.traits.choices)
    if (lower_case(choice) == lower_case(text)) return choice;
  return text;
}

}  // namespace

double radians(double degrees) { return degrees * (std::numbers::pi / 180); }

double degrees(double rad) {
  const double nearest = rad / radians(1);
  for (const double end : {-1e300, 1e300}) {
    const double neighbour = std::nextafter(nearest, end);
    if (radians(nearest) != rad && radians(neighbour) == rad) return neighbour;
  }
  return nearest;
}

std::string Option::flag() const {
  std::string flag = "--" + name;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string Option::range() const {
  if (!traits.choices.empty()) return "one of " + joined(traits.choices, ", ");
  const auto& [min, max] = traits.range;
  if (min && max) return number_text(*min) + "…" + number_text(*max);
  if (min) return "at least " + number_text(*min);
  if (max) return "at most " + number_text(*max);
  return {};
}

bool Option::holds(double number) const { return traits.range.holds(number); }

OptionList& OptionList::begin_group(std::string title) {
  group_ = std::move(title);
  return *this;
}

OptionList& OptionList::append_own(Option option) {
  option.group = group_;
  // "size_px" is in px: most names tell their unit.
  static const std::map<std::string, std::string> kUnits = {
      {"mm", "mm"},   {"px", "px"}, {"deg", "deg"}, {"s", "s"},
      {"kpa", "kPa"}, {"n", "N"},   {"db", "dB"}};
  const std::size_t last = option.name.rfind('_');
  const bool per = last != std::string::npos && option.name.substr(0, last).ends_with("_per");
  if (last != std::string::npos && option.traits.unit.empty() && !per)
    if (const auto found = kUnits.find(option.name.substr(last + 1)); found != kUnits.end())
      option.traits.unit = found->second;
  options_.push_back(std::move(option));
  return *this;
}

OptionList& OptionList::retire(std::string name, std::string instead, bool was_switch) {
  retired_.push_back({std::move(name), std::move(instead), was_switch});
  return *this;
}

OptionList& OptionList::append(const OptionList& other) {
  options_.insert(options_.end(), other.options_.begin(), other.options_.end());
  retired_.insert(retired_.end(), other.retired_.begin(), other.retired_.end());
  return *this;
}

const Option* OptionList::find(std::string_view name) const {
  for (const Option& option : options_)
    if (same_name(option.name, name)) return &option;
  return nullptr;
}

const OptionList::Retired* OptionList::find_retired(std::string_view name) const {
  for (const Retired& retired : retired_)
    if (same_name(retired.name, name)) return &retired;
  return nullptr;
}

std::string OptionList::retired_note(std::string_view name) const {
  const Retired* retired = find_retired(name);
  return retired ? retired->name + " is no longer a setting: " + retired->instead : std::string();
}

bool OptionList::was_switch(std::string_view name) const {
  const Retired* retired = find_retired(name);
  return retired && retired->was_switch;
}

OptionList& OptionList::add(std::string name, Degrees target, OptionTraits traits) {
  const auto get = [target] { return OptionValue(degrees(*target.rad)); };
  return append_own(
      {std::move(name),
       OptionKind::number,
       std::move(traits),
       {},
       get(),
       get,
       [target](const OptionValue& v) { *target.rad = radians(std::get<double>(v)); }});
}

std::vector<std::string> OptionList::names() const {
  std::vector<std::string> names;
  for (const Option& option : options_) names.push_back(option.name);
  return names;
}

OptionValue parse_option(const Option& option, std::string_view text, const std::string& where) {
  const std::optional<OptionValue> value =
      parsed(option.kind, option.kind == OptionKind::choice ? known_choice(option, text) : text);
  if (!value) refuse(option, where, text);
  check_option(option, *value, where);
  return *value;
}

void check_option(const Option& option, const OptionValue& value, const std::string& where) {
  const auto* word = std::get_if<std::string>(&value);
  const bool right_kind = option.kind == OptionKind::number_or_auto
                              ? std::holds_alternative<double>(value) || (word && *word == "auto")
                              : value.index() == option.default_value.index();
  if (!right_kind || !allowed(option.traits, value)) refuse(option, where, option_text(value));
}

std::string option_text(const OptionValue& value) {
  struct Writer {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const { return number_text(v); }
    std::string operator()(const std::string& v) const { return v; }
    std::string operator()(const std::vector<std::string>& v) const { return joined(v, ","); }
    std::string operator()(const std::vector<double>& v) const {
      return joined(v, ",", number_text);
    }
  };
  return std::visit(Writer{}, value);
}

OptionValue OptionType<float>::to_value(float value) {
  char text[32];
  const auto written = std::to_chars(text, text + sizeof text, value);
  double shortest = value;
  std::from_chars(text, written.ptr, shortest);
  return shortest;
}

}  // namespace organbake
