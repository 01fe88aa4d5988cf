// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace organbake {

// Which numbers an option takes.
struct NumberRange {
  std::optional<double> min = {}, max = {};

  bool holds(double value) const;  // false for NaN and infinity
};

// What somebody may have meant whose number was refused, because other languages write it so: a
// comma before the decimals ("; decimals stand behind a point: 0.5"). Empty when that would not do.
// To be put at the end of an error message.
std::string meant_number(const NumberRange& range, std::string text);

// What one option, or one key figure of a report, can hold.
using OptionValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>,
                                 std::vector<std::string>>;

enum class OptionKind {
  boolean,
  integer,
  number,
  number_or_auto,  // a number, or the word "auto"
  text,
  choice,
  path,
  vector,
  integers,
  texts
};

struct OptionTraits {
  std::string help = {};
  std::string unit = {};   // "kg/m³", "HU" …; empty = the one that the name ends in, or none
  NumberRange range = {};  // of a number, or of each component of a vector
  std::vector<std::string> choices = {};      // of a text: all that it can be
  std::vector<std::string> suggestions = {};  // what shells complete a text or a path by
  bool number_too = false;      // a text that documents may also give as a whole number
  std::string value = {};       // what help calls the value: "FILE"; empty = by kind and unit
  std::string short_flag = {};  // "-o"
  // Another stage's option ("motion.range_mm") whose value a recipe that says none gives it.
  std::string as = {};
};

struct Option {
  std::string name;  // snake_case, with its unit at the end: the recipe key
  OptionKind kind = OptionKind::text;
  OptionTraits traits;
  std::string group;  // the title that it stands under in help
  OptionValue default_value;
  std::function<OptionValue()> get;
  std::function<void(const OptionValue&)> set;

  std::string flag() const;         // "--photo-size-px"
  std::string range() const;        // "4…1000000", "one of a, b"; empty when unbounded
  bool holds(double number) const;  // whether that lies in the range
};

// An angle, in radians as the code has it, that users give in degrees.
struct Degrees {
  double* rad;
};
double radians(double degrees);
double degrees(double rad);  // those that radians() brings back to the bit, where there are such

// The description of some options, bound to the variables that hold them. Everything that a user
// meets comes from it: flags, help, recipe keys, JSON Schema, the resolved options of a run.
// A variable's value at the time of add() is the default; it must outlive the list.
class OptionList {
 public:
  template <class T>
  OptionList& add(std::string name, T* target, OptionTraits traits);
  OptionList& add(std::string name, Degrees target, OptionTraits traits);
  template <class Enum>
  OptionList& add(std::string name, Enum* target, OptionTraits traits,
                  std::vector<std::pair<std::string, Enum>> choices);

  // Options that are added from now on stand under this title in help; at first it is "Options".
  OptionList& begin_group(std::string title);

  // A setting that there was once, and what stands in its place ("it is always 4"): who still gives
  // it is told so, and goes on without it.
  OptionList& retire(std::string name, std::string instead, bool was_switch = false);

  // Puts another list's options behind this one's.
  OptionList& append(const OptionList& other);

  const std::vector<Option>& all() const { return options_; }
  // Nothing when unknown. '-' and '_' are the same here, so that flags and keys share one name.
  const Option* find(std::string_view name) const;
  // "zip_level is no longer a setting: …"; empty for any other name.
  std::string retired_note(std::string_view name) const;
  // Whether a flag of a retired setting stands alone, without a value.
  bool was_switch(std::string_view name) const;
  std::vector<std::string> names() const;

 private:
  OptionList& append_own(Option option);

  struct Retired {
    std::string name, instead;
    bool was_switch;
  };
  const Retired* find_retired(std::string_view name) const;
  std::vector<Retired> retired_;
  std::string group_ = "Options";
  std::vector<Option> options_;
};

// Reads a value as a command line gives it: "true", "12", "0.5", "1,0,-1". Throws UsageError that
// names `where` (such as "--faces"), the text, and what is expected.
OptionValue parse_option(const Option& option, std::string_view text, const std::string& where);
// Throws UsageError when the value is of another kind or out of the option's range.
void check_option(const Option& option, const OptionValue& value, const std::string& where);
// As parse_option reads it; numbers in their shortest exact form.
std::string option_text(const OptionValue& value);

// How the C++ types of options map to values: most by the type that stands for them there.
template <class T, class Stored, OptionKind kKind>
struct OptionTypeAs {
  static constexpr OptionKind kind = kKind;
  static OptionValue to_value(const T& value) { return static_cast<Stored>(value); }
  static T from_value(const OptionValue& value) { return static_cast<T>(std::get<Stored>(value)); }
};
template <class T>
struct OptionType : OptionTypeAs<T, std::int64_t, OptionKind::integer> {
  static_assert(std::is_integral_v<T>, "no option of this type");
};
template <>
struct OptionType<bool> : OptionTypeAs<bool, bool, OptionKind::boolean> {};
template <>
struct OptionType<double> : OptionTypeAs<double, double, OptionKind::number> {};
template <>
struct OptionType<float> : OptionTypeAs<float, double, OptionKind::number> {
  // Through the float's shortest decimal: users see 0.42, not 0.41999998688697815.
  static OptionValue to_value(float value);
};
template <>
struct OptionType<std::string> : OptionTypeAs<std::string, std::string, OptionKind::text> {};
template <>
struct OptionType<std::filesystem::path>
    : OptionTypeAs<std::filesystem::path, std::string, OptionKind::path> {};
template <>
struct OptionType<std::vector<std::string>>
    : OptionTypeAs<std::vector<std::string>, std::vector<std::string>, OptionKind::texts> {};
// Nothing is the word "auto": the stage finds the value.
template <>
struct OptionType<std::optional<double>> {
  static constexpr OptionKind kind = OptionKind::number_or_auto;
  static OptionValue to_value(const std::optional<double>& value) {
    if (value) return *value;
    return std::string("auto");
  }
  static std::optional<double> from_value(const OptionValue& value) {
    const auto* number = std::get_if<double>(&value);
    return number ? std::optional(*number) : std::nullopt;
  }
};
// Three components: std::array or an Eigen vector.
template <class Vector, class Scalar>
struct OptionTypeOfVector {
  static constexpr OptionKind kind =
      std::is_integral_v<Scalar> ? OptionKind::integers : OptionKind::vector;
  static OptionValue to_value(const Vector& vector) {
    using Number = OptionType<std::conditional_t<std::is_integral_v<Scalar>, double, Scalar>>;
    std::vector<double> values;
    for (int i = 0; i < 3; ++i) values.push_back(std::get<double>(Number::to_value(vector[i])));
    return values;
  }
  static Vector from_value(const OptionValue& value) {
    Vector vector;
    for (int i = 0; i < 3; ++i)
      vector[i] = static_cast<Scalar>(std::get<std::vector<double>>(value)[i]);
    return vector;
  }
};
template <>
struct OptionType<Eigen::Vector3d> : OptionTypeOfVector<Eigen::Vector3d, double> {};
template <>
struct OptionType<Eigen::Vector3f> : OptionTypeOfVector<Eigen::Vector3f, float> {};
template <>
struct OptionType<std::array<int, 3>> : OptionTypeOfVector<std::array<int, 3>, int> {};

template <class T>
OptionList& OptionList::add(std::string name, T* target, OptionTraits traits) {
  using Type = OptionType<T>;
  const bool choice = Type::kind == OptionKind::text && !traits.choices.empty();
  return append_own({std::move(name),
                     choice ? OptionKind::choice : Type::kind,
                     std::move(traits),
                     {},
                     Type::to_value(*target),
                     [target] { return Type::to_value(*target); },
                     [target](const OptionValue& v) { *target = Type::from_value(v); }});
}

template <class Enum>
OptionList& OptionList::add(std::string name, Enum* target, OptionTraits traits,
                            std::vector<std::pair<std::string, Enum>> choices) {
  for (const auto& choice : choices) traits.choices.push_back(choice.first);
  auto name_of = [choices](Enum value) {
    for (const auto& choice : choices) {
      if (choice.second == value) return choice.first;
    }
    return std::string();
  };
  return append_own({std::move(name),
                     OptionKind::choice,
                     std::move(traits),
                     {},
                     name_of(*target),
                     [target, name_of]() -> OptionValue { return name_of(*target); },
                     [target, choices](const OptionValue& v) {
                       for (const auto& choice : choices) {
                         if (choice.first == std::get<std::string>(v)) *target = choice.second;
                       }
                     }});
}

}  // namespace organbake
