// SPDX-License-Identifier: GPL-3.0-or-later
#include "commands.h"
#include "organbake/pipelines/recipe_library.h"

namespace organbake {
namespace {

std::vector<std::string> command_names() {
  std::vector<std::string> names;
  for (const Stage& stage : all_stages()) names.push_back(stage.name);
  for (const Verb& verb : all_verbs()) names.emplace_back(verb.name);
  return names;
}

std::vector<std::string> shells() { return {"bash", "zsh"}; }

}  // namespace

std::span<const Verb> all_verbs() {
  static constexpr Verb kVerbs[] = {
      {"bake", "run a recipe from its inputs to a bundle", run_bake, known_recipe_names},
      {"new", "look at a folder of scans or clips and write a recipe for it", run_new},
      {"batch", "run a recipe over many cases, each in a process of its own", run_batch},
      {"plan", "write a batch as commands, a Snakefile or a Slurm array", run_plan},
      {"report", "write a page about a bundle: warnings, pictures, errors", run_report},
      {"export", "write a bundle for other programs: glTF, COLMAP, NeRF, OBJ", run_export},
      {"recipes", "list the recipes that come with organbake, or print one", run_recipes,
       known_recipe_names},
      {"materials", "list the looks of tissues, and draw them all", run_materials},
      {"inspect", "tell what a file or folder holds", run_inspect},
      {"verify", "check a bundle, a document or a recipe", run_verify},
      {"reseal", "take over maps of a bundle that were edited by hand", run_reseal},
      {"schema", "print the JSON Schema of a document", run_schema},
      {"doctor", "check this installation", run_doctor},
      {"man", "print a command's manual page, or write them all", run_man, command_names},
      {"completions", "print the completions for bash or zsh", run_completions, shells},
  };
  return kVerbs;
}

}  // namespace organbake
