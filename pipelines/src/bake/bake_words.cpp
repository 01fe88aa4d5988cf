// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/bake_words.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include "bake/input_frame.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/stage.h"

namespace organbake {
namespace {

bool is_flag_letter(char c) { return std::islower(static_cast<unsigned char>(c)) || c == '-'; }

// What follows a flag: "2", a word that the option knows, an input's path, or a placeholder such as
// FILE.
bool is_value(const Option* option, const std::string& word) {
  if (word.empty()) return false;
  const auto upper = [](unsigned char c) { return std::isupper(c) != 0; };
  if (std::isdigit(static_cast<unsigned char>(word[0]))) return true;
  if (std::all_of(word.begin(), word.end(), upper)) return true;
  if (!option) return word.find_first_of("./") != word.npos;
  const auto& choices = option->traits.choices;
  return std::find(choices.begin(), choices.end(), word) != choices.end();
}

struct Meant {
  std::string key;  // of --set; empty: nothing of the stage
  const Option* option = nullptr;
  bool off = false;  // --no-…
};

Meant meant_by(const Stage& stage, const OptionList& options, const std::string& flag) {
  const bool off = flag.starts_with("no-");
  const std::string name = off ? flag.substr(3) : flag;
  if (is_input_frame_key(name)) return {};  // bakes have that flag, too
  if (const Option* option = options.find(name))
    return {stage.name + "." + option->name, option, off};
  for (const StageInput& input : stage.inputs)
    if (flag == (input.flag.empty() ? input.name : input.flag) && is_recipe_input(input.name))
      return {input.name};
  return {};
}

std::string setting(const Meant& meant, const std::string& value) {
  const bool toggle = meant.option && meant.option->kind == OptionKind::boolean;
  return "--set " + meant.key + "=" +
         (!value.empty() ? value
          : !toggle      ? "…"
          : meant.off    ? "false"
                         : "true");
}

}  // namespace

std::string in_bake_words(const std::string& stage_name, const std::string& text) {
  const Stage* stage = find_stage(stage_name);
  if (!stage || text.find("--") == text.npos) return text;
  const StageOptions options = stage->make_options();
  std::string told;
  std::size_t at = 0;
  while (at < text.size()) {
    const bool begins =
        text.compare(at, 2, "--") == 0 && (at == 0 || !is_flag_letter(text[at - 1]));
    const auto end = std::find_if_not(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(),
                                      is_flag_letter) -
                     text.begin();
    const std::string flag =
        begins ? text.substr(at + 2, static_cast<std::size_t>(end) - at - 2) : "";
    const Meant meant = flag.empty() ? Meant() : meant_by(*stage, options.list, flag);
    if (meant.key.empty()) {
      told += text[at++];
      continue;
    }
    at = static_cast<std::size_t>(end);
    std::string value;
    if (at < text.size() && (text[at] == ' ' || text[at] == '=')) {
      value = text.substr(at + 1, text.find_first_of(" ,;:)", at + 1) - at - 1);
      if (value.ends_with('.')) value.pop_back();
      if (!is_value(meant.option, value)) value.clear();
    }
    if (!value.empty()) at += 1 + value.size();
    told += setting(meant, value);
  }
  return told;
}

}  // namespace organbake
