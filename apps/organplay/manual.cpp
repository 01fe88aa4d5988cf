// SPDX-License-Identifier: Apache-2.0
#include "manual.h"

#include <CLI/CLI.hpp>
#include <sstream>

#include "command_manual.h"

namespace organbake {
namespace {

// CLI11 tells the choices of an option in its type: "TEXT:{bound,paper}".
std::vector<std::string> choices_of(const std::string& type) {
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  std::vector<std::string> choices;
  std::istringstream words(type.substr(open + 1, close - open - 1));
  for (std::string word; std::getline(words, word, ',');) choices.push_back(word);
  return choices;
}

std::string facts_of(const std::string& type, const std::vector<std::string>& choices,
                     const std::string& default_text) {
  std::string facts;
  for (const std::string& choice : choices) facts += (facts.empty() ? "one of " : ", ") + choice;
  const std::size_t range = type.find('[');
  if (range != std::string::npos) facts = type.substr(range + 1, type.find(']') - range - 1);
  if (default_text.empty()) return facts;
  return facts + (facts.empty() ? "" : "; ") + "default " + default_text;
}

ManualOption option_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  ManualOption manual{.flag = "--" + option.get_lnames().front(),
                      .help = option.get_description(),
                      .choices = choices_of(type)};
  if (!option.get_snames().empty()) manual.short_flag = "-" + option.get_snames().front();
  if (option.get_expected_max() > 0) manual.value = type.substr(0, type.find_first_of(":{ "));
  manual.facts = facts_of(type, manual.choices, option.get_default_str());
  return manual;
}

CommandManual manual_of(const CLI::App& app) {
  CommandManual manual{
      .program = "organplay",
      .summary = "poke a baked organ and draw it",
      .synopsis = "[OPTIONS] [BUNDLE...]",
      .description =
          "Plays bundles that organbake(1) made: tissue yields to instruments, and pictures are "
          "warped from the baked ones, on the processor alone. Without any of --script, --frame, "
          "--sheet, --compare and --bench it opens a window, which is a package of its own "
          "(organplay-window).",
      .see_also = {"organbake", "organbake-bake"}};
  ManualSection words{.title = "arguments"};
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional()) {
      words.entries.emplace_back(option->get_name(true), option->get_description());
    } else {
      manual.options.push_back(option_of(*option));
    }
  }
  manual.sections = {words, exit_status_section()};
  return manual;
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  return man_page(manual_of(app), ORGANBAKE_VERSION, ORGANBAKE_RELEASE_DATE);
}

std::string completions(const CLI::App& app, const std::string& shell) {
  const CommandManual manual = manual_of(app);
  return shell == "bash" ? bash_completion(manual, {}) : zsh_completion(manual, {});
}

}  // namespace organbake
