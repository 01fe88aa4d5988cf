// SPDX-License-Identifier: GPL-3.0-or-later
#include "commands.h"

namespace organbake {

std::span<const Verb> all_verbs() {
  static constexpr Verb kVerbs[] = {
      {"bake", "run a recipe from its inputs to a bundle", run_bake},
      {"batch", "run a recipe over many cases, each in a process of its own", run_batch},
      {"plan", "write a batch as commands, a Snakefile or a Slurm array", run_plan},
      {"report", "write a page about a bundle: warnings, pictures, errors", run_report},
      {"export", "write a bundle for other programs: glTF, COLMAP, NeRF, OBJ", run_export},
      {"inspect", "tell what a file or folder holds", run_inspect},
      {"verify", "check a bundle, a document or a recipe", run_verify},
      {"reseal", "take over maps of a bundle that were edited by hand", run_reseal},
      {"schema", "print the JSON Schema of a document", run_schema},
      {"doctor", "check this installation", run_doctor},
      {"man", "print a command's manual page, or write them all", run_man},
      {"completions", "print the completions for bash or zsh", run_completions},
  };
  return kVerbs;
}

}  // namespace organbake
