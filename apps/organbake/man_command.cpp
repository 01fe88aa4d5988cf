// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "commands.h"
#include "manuals.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/nearest_name.h"
#include "organbake/core/version.h"

namespace organbake {
namespace {

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
      {}, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake completions' needs a shell: bash or zsh");
  const std::string& shell = words->front();
  if (shell != "bash" && shell != "zsh") {
    throw UsageError("'" + shell + "': there are completions for bash and zsh");
  }
  write_to_stdout(shell == "bash" ? bash_completion(program_manual(), command_manuals())
                                  : zsh_completion(program_manual(), command_manuals()));
  return 0;
}

}  // namespace organbake
