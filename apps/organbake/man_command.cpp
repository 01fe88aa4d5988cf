// SPDX-License-Identifier: GPL-3.0-or-later
// organbake man and completions, made from the tables that commands read their options by.
#include <nlohmann/json.hpp>
#include <vector>

#include "command_line.h"
#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"

namespace organbake {
namespace {

constexpr const char* kProgram = "organbake";

ManualSection files_section(const Stage& stage) {
  ManualSection section{.title = "files written"};
  if (stage.single_file) {
    section.text = "The one file that --output names.";
    return section;
  }
  section.text =
      "The folder that --output names, with report.json (the options as they were used, key "
      "figures, what was skipped and why) and these files:";
  for (const StageOutput& output : stage.outputs) {
    if (output.file == ".") continue;
    section.entries.emplace_back(
        output.file, output.may_be_missing ? "Not every run can tell it." : "Always there.");
  }
  if (section.entries.empty()) {
    section.text = "The folder that --output names, with report.json.";
  }
  return section;
}

ManualSection recipe_section(const Stage& stage) {
  return {.title = "in a recipe",
          .text = "The section '" + stage.name +
                  ":' takes the same options; a key is the flag without its dashes, with '_' for "
                  "each '-' within it. On the command line of 'organbake bake' it is --set " +
                  stage.name + ".KEY=VALUE. Inputs are keys of the section 'inputs:'."};
}

void finish(CommandManual& manual, const Session& session) {
  manual.shared_options = session.shared_manual();
  manual.sections.push_back(exit_status_section());
  manual.see_also = {kProgram};
}

CommandManual stage_manual(const Stage& stage) {
  CommandManual manual{.program = kProgram, .command = stage.name, .summary = stage.summary};
  Session session;
  session.only_describe(manual);
  run_stage_command(stage, {}, session);
  manual.sections = {files_section(stage), recipe_section(stage)};
  finish(manual, session);
  return manual;
}

CommandManual verb_manual(const Verb& verb) {
  CommandManual manual{.program = kProgram, .command = verb.name, .summary = verb.summary};
  Session session;
  session.only_describe(manual);
  verb.run({}, session);
  if (verb.known_words) manual.words = verb.known_words();
  finish(manual, session);
  return manual;
}

// Every stage, then every other command, in the order in which help lists them.
std::vector<CommandManual> command_manuals() {
  std::vector<CommandManual> manuals;
  for (const Stage& stage : all_stages()) manuals.push_back(stage_manual(stage));
  for (const Verb& verb : all_verbs()) manuals.push_back(verb_manual(verb));
  return manuals;
}

// organbake itself: its shared options and its commands, each with its page.
CommandManual program_manual() {
  CommandManual manual{
      .program = kProgram,
      .summary = "bake CT scans and laparoscopy into deformable organs",
      .synopsis = "COMMAND [ARGUMENTS]",
      .description =
          "Turns a CT scan, or a laparoscopy video, into an organ that can be poked: a bundle, "
          "which organplay(1) draws and deforms without a GPU. A stage is one step of that way; "
          "'organbake bake' runs all that a recipe needs, and only what has changed since the "
          "last time. Results go to the standard output, everything else to standard error. "
          "Outputs appear whole or not at all, and have the same bytes for any number of threads."};
  ManualSection stages{.title = "stages"}, verbs{.title = "commands"};
  for (const Stage& stage : all_stages()) {
    stages.entries.emplace_back(stage.name,
                                stage.summary + "; see organbake-" + stage.name + "(1).");
    manual.see_also.push_back("organbake-" + stage.name);
  }
  for (const Verb& verb : all_verbs()) {
    verbs.entries.emplace_back(verb.name,
                               std::string(verb.summary) + "; see organbake-" + verb.name + "(1).");
    manual.see_also.push_back("organbake-" + std::string(verb.name));
  }
  manual.see_also.push_back("organplay");
  manual.options = Session().shared_manual();
  manual.sections = {
      stages,
      verbs,
      {.title = "environment",
       .entries = {{"ORGANBAKE_CACHE",
                    "Folder of the cache of finished steps; else ~/.cache/organbake."},
                   {"NO_COLOR", "When set, messages on a terminal have no colours."}}},
      {.title = "files",
       .entries = {{"~/.config/organbake/config",
                    "Defaults, one a line: threads = N, color = auto|always|never, cache = FOLDER. "
                    "A flag goes before them, ORGANBAKE_CACHE before the cache. Below "
                    "$XDG_CONFIG_HOME where that is set."}}},
      exit_status_section()};
  return manual;
}

namespace fs = std::filesystem;

std::string page_text(const CommandManual& manual) {
  return man_page(manual, kVersion, kReleaseDate);
}

CommandManual manual_called(const std::string& command) {
  std::vector<std::string> names;
  for (const CommandManual& manual : command_manuals()) {
    if (manual.command == command) return manual;
    names.push_back(manual.command);
  }
  throw UsageError("there is no command '" + command + "'" + suggestion(command, names) +
                   " (organbake --help lists all)");
}

// Files of these names in a folder that may hold others, as man's own folders do.
void write_pages(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) {
    throw IoError::writing(folder, error ? error.message() : "is a file; name a folder");
  }
  std::vector<CommandManual> manuals = command_manuals();
  manuals.push_back(program_manual());
  for (const CommandManual& manual : manuals) {
    write_file_atomically(folder / (manual.page() + ".1"), page_text(manual));
  }
}

}  // namespace

int run_man(const Arguments& arguments, Session& session) {
  fs::path output;
  OptionList options;
  options.add(
      "output", &output,
      {.help = "write every page into this folder instead", .value = "DIR", .short_flag = "-o"});
  const auto words = session.read_command(
      arguments, "man [COMMAND] [-o DIR]",
      "Prints the manual page of organbake, or of one of its commands, for man(1): organbake man "
      "bake | man -l -. Pages are made from the tables that the commands read their options by.",
      options, 1);
  if (!words) return 0;
  if (!output.empty()) {
    if (!words->empty()) throw UsageError("-o writes all pages; leave out " + words->front());
    write_pages(output);
    session.print_result(output.string(), {{"output", output.string()}});
    return 0;
  }
  write_to_stdout(page_text(words->empty() ? program_manual() : manual_called(words->front())));
  return 0;
}

int run_completions(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "completions bash|zsh",
      "Prints a script with which the shell completes commands, flags and their values: eval "
      "\"$(organbake completions bash)\" for this shell, or into the shell's folder of "
      "completions, as the Debian package has it.",
      {}, 1, "a shell: bash or zsh");
  if (!words) return 0;
  const std::string& shell = words->front();
  if (shell != "bash" && shell != "zsh") {
    throw UsageError("'" + shell + "': there are completions for bash and zsh");
  }
  write_to_stdout(completion(shell, program_manual(), command_manuals()));
  return 0;
}

}  // namespace organbake
