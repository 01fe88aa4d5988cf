// SPDX-License-Identifier: Apache-2.0
#include "command_line.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"

namespace organbake {
namespace {

std::string long_flag(const std::string& flag, const OptionList& options) {
  for (const Option& option : options.all()) {
    if (!flag.empty() && flag == option.traits.short_flag) return option.flag();
  }
  return flag;
}

[[noreturn]] void unknown_flag(const std::string& flag, const OptionList& options) {
  std::vector<std::string> flags;
  for (const Option& option : options.all()) flags.push_back(option.flag());
  throw UsageError("unknown flag " + flag + suggestion(flag, flags) + " (--help lists all)");
}

// Or a choice that was one once, and still takes true and false.
bool is_switch(const Option& option) {
  const auto& choices = option.traits.choices;
  return option.kind == OptionKind::boolean ||
         std::find(choices.begin(), choices.end(), "false") != choices.end();
}

void set_option(const Option& option, const OptionValue& value) {
  if (option.kind != OptionKind::texts) return option.set(value);
  auto all = std::get<std::vector<std::string>>(option.get());  // repeatable: each adds
  all.push_back(std::get<std::vector<std::string>>(value).front());
  option.set(all);
}

// Whether a word behind the flag of a retired setting is its value: of a switch, which stood alone
// but may be given one, only what can be nothing else.
bool is_value_of_retired(const std::string& word, bool was_switch) {
  if (word.starts_with("--")) return false;
  static const std::set<std::string> kSwitched = {"true", "false", "yes", "no", "on", "off"};
  const bool number =
      !word.empty() && word.find_first_not_of("+-.0123456789eE") == std::string::npos;
  return !was_switch || number || kSwitched.contains(word);
}

// Reads the flag at `position` and its value; returns the position behind them.
std::size_t read_flag(const Arguments& arguments, std::size_t position, const OptionList& options,
                      std::vector<std::string>& notes) {
  const std::size_t equals = arguments[position].find('=');
  const std::string flag = long_flag(arguments[position].substr(0, equals), options);
  if (!flag.starts_with("--")) unknown_flag(flag, options);
  const std::string name = flag.substr(flag.starts_with("--no-") ? 5 : 2);
  if (const std::string retired = options.retired_note(name); !retired.empty()) {
    notes.push_back(retired);
    const bool alone = equals != std::string::npos || flag.starts_with("--no-") ||
                       position + 1 == arguments.size() ||
                       !is_value_of_retired(arguments[position + 1], options.was_switch(name));
    return position + (alone ? 1 : 2);
  }
  const Option* option = options.find(flag.substr(2));
  if (!option && flag.starts_with("--no-")) {
    option = options.find(flag.substr(5));
    if (!option || !is_switch(*option)) unknown_flag(flag, options);
    option->set(parse_option(*option, "false", flag));
    return position + 1;
  }
  if (!option) unknown_flag(flag, options);
  if (equals != std::string::npos) {
    set_option(*option, parse_option(*option, arguments[position].substr(equals + 1), flag));
  } else if (option->kind == OptionKind::boolean) {
    option->set(true);
  } else if (position + 1 == arguments.size()) {
    throw UsageError(flag + ": its value is missing");
  } else {
    set_option(*option, parse_option(*option, arguments[++position], flag));
  }
  return position + 1;
}

// A number is called by its unit where that is a word.
std::string number_name(const std::string& unit) {
  static const std::map<std::string, std::string> kNames = {
      {"mm", "MM"}, {"mm, LPS", "MM"},  {"deg", "DEG"}, {"px", "PX"},
      {"s", "S"},   {"dB", "DB"},       {"kPa", "KPA"}, {"HU", "HU"},
      {"MB", "MB"}, {"min", "MINUTES"}, {"h", "HOURS"}};
  const auto found = kNames.find(unit);
  return found == kNames.end() ? "X" : found->second;
}

std::string value_name(const Option& option) {
  if (!option.traits.value.empty()) return option.traits.value;
  switch (option.kind) {
    case OptionKind::boolean:
      return "";
    case OptionKind::integer:
      return option.traits.unit.empty() ? "N" : number_name(option.traits.unit);
    case OptionKind::vector:
    case OptionKind::integers:
      return "X,Y,Z";
    case OptionKind::path:
      return "PATH";
    case OptionKind::choice:
      return "NAME";
    case OptionKind::number:
      return number_name(option.traits.unit);
    case OptionKind::number_or_auto:
      return number_name(option.traits.unit) + "|auto";
    default:
      return "TEXT";
  }
}

// Its unit, its range and its default.
std::string facts_of(const Option& option) {
  std::string facts = option.traits.unit;
  const auto add = [&](const std::string& fact) {
    if (!fact.empty()) facts += (facts.empty() ? "" : "; ") + fact;
  };
  add(option.range());
  const double* number = std::get_if<double>(&option.default_value);
  const bool angle = number && option.traits.unit == "deg";  // 0.6 rad are no round number of them
  const std::string default_text = angle ? to_text(*number, 1) : option_text(option.default_value);
  const bool plain_switch = option.kind == OptionKind::boolean && default_text == "false";
  const auto* whole = std::get_if<std::int64_t>(&option.default_value);
  const bool stands_for_none =
      (number && !option.holds(*number)) || (whole && !option.holds(static_cast<double>(*whole)));
  if (!default_text.empty() && !plain_switch && !stands_for_none) add("default " + default_text);
  return facts;
}

ManualOption manual_option(const Option& option) {
  ManualOption manual{.flag = option.flag(),
                      .short_flag = option.traits.short_flag,
                      .value = value_name(option),
                      .help = option.traits.help,
                      .facts = facts_of(option),
                      .choices = option.traits.choices,
                      .suggestions = option.traits.suggestions};
  const bool* on = std::get_if<bool>(&option.default_value);
  if ((on && *on) || (!on && is_switch(option)))
    manual.off_flag = "--no-" + option.flag().substr(2);
  return manual;
}

std::filesystem::path folder_named_by(const char* variable) {
  const char* value = std::getenv(variable);
  return value && *value == '/' ? std::filesystem::path(value) : std::filesystem::path();
}

// "threads = 2"; empty lines and what follows a '#' at a line's start tell nothing.
void read_default(const std::string& line, const OptionList& known, const std::string& where) {
  if (line.empty() || line.front() == '#') return;
  const std::size_t equals = line.find('=');
  if (equals == std::string::npos)
    throw UsageError(where + ": '" + line + "' is not 'KEY = VALUE', such as 'threads = 2'");
  const std::string key = trimmed(line.substr(0, equals));
  std::vector<std::string> keys;
  for (const Option& option : known.all()) keys.push_back(option.name);
  const Option* option = known.find(key);
  if (!option)
    throw UsageError(where + ": unknown key '" + key + "'" + suggestion(key, keys) +
                     " (threads, color and cache have defaults)");
  option->set(parse_option(*option, trimmed(line.substr(equals + 1)), where + ": " + key));
}

std::string explanation(const ManualOption& option) {
  std::string facts = option.facts;
  if (!option.off_flag.empty()) facts += "; " + option.off_flag + " turns it off";
  return facts.empty() ? option.help : option.help + " [" + facts + "]";
}

// Those that a user may set once and for all.
void add_defaults(OptionList& list, SharedFlags& flags) {
  list.add("threads", &flags.threads,
           {.help = "at most this many threads; 0 = all. Results don't depend on it",
            .range = {0, 4096}})
      .add("color", &flags.color,
           {.help = "colours in messages; auto: on a terminal, unless NO_COLOR is set",
            .choices = {"auto", "always", "never"}});
}

// $XDG_CONFIG_HOME/organbake/config, else ~/.config/organbake/config; empty without a home.
std::filesystem::path configuration_file() {
  const std::filesystem::path own = folder_named_by("XDG_CONFIG_HOME"),
                              home = folder_named_by("HOME");
  const std::filesystem::path folder = !own.empty() || home.empty() ? own : home / ".config";
  return folder.empty() ? folder : folder / "organbake" / "config";
}

}  // namespace

std::vector<std::string> read_arguments(Arguments& arguments, const OptionList& options,
                                        std::vector<std::string>& notes, bool only_leading) {
  std::vector<std::string> words;
  std::size_t position = 0;
  while (position < arguments.size()) {
    const std::string& argument = arguments[position];
    const bool is_flag = argument.size() > 1 && argument.front() == '-';
    if (argument == "--" && !only_leading) {
      words.insert(words.end(), arguments.begin() + position + 1, arguments.end());
      break;
    }
    if (is_flag) {
      position = read_flag(arguments, position, options, notes);
    } else if (only_leading) {
      break;
    } else {
      words.push_back(argument);
      ++position;
    }
  }
  if (only_leading) arguments.erase(arguments.begin(), arguments.begin() + position);
  return words;
}

std::vector<ManualOption> manual_options(const OptionList& options) {
  std::vector<ManualOption> manual;
  for (const Option& option : options.all()) manual.push_back(manual_option(option));
  return manual;
}

std::string options_help(const OptionList& options) {
  constexpr std::size_t kColumn = 28;
  std::string text, group;
  const std::vector<ManualOption> manual = manual_options(options);
  for (std::size_t i = 0; i < manual.size(); ++i) {
    const ManualOption& option = manual[i];
    if (options.all()[i].group != group) {
      group = options.all()[i].group;
      text += "\n" + group + ":\n";
    }
    std::string line = "  " + (option.short_flag.empty() ? "" : option.short_flag + ", ") +
                       option.flag + (option.value.empty() ? "" : " " + option.value);
    line += line.size() < kColumn ? std::string(kColumn - line.size(), ' ')
                                  : "\n" + std::string(kColumn, ' ');
    text += line + explanation(option) + "\n";
  }
  return text;
}

OptionList SharedFlags::options() {
  OptionList list;
  add_defaults(list.begin_group("Shared options"), *this);
  list.add("json", &json, {.help = "the result as JSON"})
      .add("quiet", &quiet, {.help = "say nothing but warnings and errors", .short_flag = "-q"})
      .add("verbose", &verbose, {.help = "say more", .short_flag = "-v"})
      .add("version", &version, {.help = "print the version; with --json more about it"})
      .add("help", &help, {.help = "print this", .short_flag = "-h"});
  return list;
}

void SharedFlags::read_defaults() {
  const std::filesystem::path file = configuration_file();
  std::error_code unreachable;  // as another user, in somebody's home
  if (file.empty() || !std::filesystem::exists(file, unreachable)) return;
  OptionList known;
  add_defaults(known, *this);
  known.add("cache", &cache, {.help = "folder of the cache", .value = "DIR"});
  constexpr std::size_t kMostBytes = 1 << 16;
  std::istringstream lines(read_text_file(file, kMostBytes));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number)
    read_default(trimmed(line), known, file.string() + ", line " + std::to_string(number));
}

OptionList ManualFlags::options() {
  OptionList list;
  list.begin_group("Manuals")
      .add("man", &man, {.help = "print the manual page, for man -l -"})
      .add("completions", &shell,
           {.help = "print the completions for a shell", .choices = {"bash", "zsh"}});
  return list;
}

std::optional<std::string> ManualFlags::text(const CommandManual& manual) const {
  if (man) return man_page(manual, kVersion, kReleaseDate);
  return shell.empty() ? std::nullopt : std::optional(completion(shell, manual, {}));
}

std::string version_text(const std::string& program, bool json) {
  const std::string version = kVersion, released = kReleaseDate;
  if (!json) return program + " " + version + "\n";
  return "{\n  \"" + program + "\": \"" + version + "\",\n  \"released\": \"" + released +
         "\"\n}\n";
}

}  // namespace organbake
