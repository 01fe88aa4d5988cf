// SPDX-License-Identifier: GPL-3.0-or-later
#include "manuals.h"

#include "commands.h"

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

}  // namespace

std::vector<CommandManual> command_manuals() {
  std::vector<CommandManual> manuals;
  for (const Stage& stage : all_stages()) manuals.push_back(stage_manual(stage));
  for (const Verb& verb : all_verbs()) manuals.push_back(verb_manual(verb));
  return manuals;
}

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

}  // namespace organbake
