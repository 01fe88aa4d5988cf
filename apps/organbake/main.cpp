// SPDX-License-Identifier: GPL-3.0-or-later
// The front program: its commands, and which of them an argument names.
#include <malloc.h>
#include <exception>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/recipe.h"

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

namespace {

std::string line(const std::string& name, const std::string& summary) {
  constexpr std::size_t kColumn = 13;
  return "  " + name + std::string(kColumn - name.size(), ' ') + summary + "\n";
}

std::string overview(const Session& session) {
  std::string text =
      "organbake: bakes CT scans into image-based deformable organs\n\n"
      "usage: organbake COMMAND [ARGUMENTS]   (COMMAND --help tells more)\n\nStages:\n";
  for (const Stage& stage : all_stages()) text += line(stage.name, stage.summary);
  text += "\nCommands:\n";
  for (const Verb& verb : all_verbs()) text += line(verb.name, verb.summary);
  return text + session.shared_help();
}

[[noreturn]] void unknown_command(const std::string& name) {
  throw UsageError("unknown command '" + name + "'" + suggestion(name, command_names()) +
                   " (--help lists all)");
}

void tell_version(Session& session) {
  if (!session.json()) return write_to_stdout(version_text("organbake", false));
  unloadable_modules();  // so that their libraries can be asked; doctor tells what cannot be loaded
  session.print_result({}, {{"organbake", kVersion},
                            {"released", kReleaseDate},
                            {"compiler", __VERSION__},
                            {"libraries", library_versions()}});
}

int dispatch(Arguments arguments, Session& session) {
  session.read_leading_flags(arguments);
  if (session.version_asked()) {
    tell_version(session);
    return 0;
  }
  if (arguments.empty() && !session.help_asked()) {
    throw UsageError("a command is missing (--help lists all)");
  }
  if (session.help_asked()) {
    write_to_stdout(overview(session));
    return 0;
  }
  const std::string name = arguments.front();
  arguments.erase(arguments.begin());
  for (const Verb& verb : all_verbs()) {
    if (name == verb.name) return verb.run(arguments, session);
  }
  const Stage* stage = find_stage(name);
  if (!stage) unknown_command(name);
  return run_stage_command(*stage, arguments, session);
}

// The pictures of a clip come and go by the hundred. Memory that one gave back serves the next;
// to return it to the system and have it cleared again took a tenth of the time of `stereo`.
void keep_freed_memory() {
  constexpr int kMapped_bytes = 64 << 20, kKept_bytes = 512 << 20;
  mallopt(M_MMAP_THRESHOLD, kMapped_bytes);
  mallopt(M_TRIM_THRESHOLD, kKept_bytes);
}

int run(int argc, char** argv) {
  keep_freed_memory();
  catch_signals();
  Session session;
  try {
    return dispatch(Arguments(argv + 1, argv + argc), session);
  } catch (const std::exception& error) {
    session.terminal().error(message_for(error));
    return static_cast<int>(exit_code_for(error));
  }
}

}  // namespace
}  // namespace organbake
int main(int argc, char** argv) { return organbake::run(argc, argv); }
