// SPDX-License-Identifier: GPL-3.0-or-later
// The front program: what all commands share (messages, progress, signals, the cache's folder),
// which they are, and which of them an argument names.
#include "commands.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <exception>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/recipe.h"
#include "stop_signal.h"

namespace organbake {
namespace {

const std::atomic<bool>* stop_asked = nullptr;  // since catch_signals()

// What a stage freed lies in pieces that the next one rarely fits into: it goes back to the system,
// or a bake would need the memory of its stages together.
StageReport run_and_return_memory(const Stage& stage, const StageCall& call) {
  StageReport report = run_in_module(stage, call);
  ::malloc_trim(0);
  return report;
}

RunContext reworded(const RunContext& context, const Runner::Words& words) {
  return {[context, words](LogLevel level, std::string_view said) {
            const std::string told = words(std::string(said));
            if (told.empty()) return;
            if (level == LogLevel::warning) return context.warn(told);
            level == LogLevel::info ? context.info(told) : context.debug(told);
          },
          [context](double fraction) { context.progress(fraction); }, stop_asked};
}

}  // namespace

Session::Session() : shared_(flags_.options()) {}
Session::~Session() = default;

std::string Session::shared_help() const { return options_help(shared_); }

void Session::read_leading_flags(Arguments& arguments) {
  flags_.read_defaults();
  std::vector<std::string> notes;
  read_arguments(arguments, shared_, notes, true);
  obey_shared_flags();
}

void Session::obey_shared_flags() {
  terminal_.obey(flags_);
  if (flags_.threads > 0 && !thread_limit_)
    thread_limit_ = std::make_unique<ThreadLimit>(flags_.threads);
}

std::optional<std::vector<std::string>> Session::read_command(
    Arguments arguments, const std::string& usage, const std::string& summary,
    const OptionList& options, std::size_t most_words, const std::string& needs) {
  if (described_) {
    described_->synopsis = usage;
    described_->description = summary;
    described_->options = manual_options(options);
    return std::nullopt;
  }
  OptionList all = options;
  all.append(shared_);
  std::vector<std::string> notes;
  const std::vector<std::string> words = read_arguments(arguments, all, notes);
  if (flags_.help) {
    write_to_stdout("usage: organbake " + usage + "\n\n" + summary + "\n" + options_help(options) +
                    shared_help());
    return std::nullopt;
  }
  if (words.size() > most_words) {
    throw UsageError("'" + words[most_words] + "' is one word too many; usage: organbake " + usage);
  }
  if (words.empty() && !needs.empty())
    throw UsageError("'organbake " + usage.substr(0, usage.find(' ')) + "' needs " + needs);
  obey_shared_flags();
  for (const std::string& note : notes) terminal_.log(LogLevel::info, note);
  return words;
}

RunContext Session::context(const std::string& task) { return terminal_.context(task, stop_asked); }

std::filesystem::path Session::chosen_cache(const std::filesystem::path& asked) const {
  const char* variable = std::getenv("ORGANBAKE_CACHE");
  const bool from_file = asked.empty() && !(variable && *variable);
  return from_file ? flags_.cache : asked;
}

Runner Session::runner(const std::filesystem::path& cache_folder) {
  const std::filesystem::path chosen = chosen_cache(cache_folder);
  const std::filesystem::path folder = chosen.empty() ? Cache::default_folder() : chosen;
  if (chosen.empty() && folder == Cache::temporary_folder()) {
    terminal_.log(LogLevel::warning, "there is no home folder to write to; the cache is " +
                                         folder.string() + " (--cache or ORGANBAKE_CACHE)");
  }
  return {Cache(folder), run_and_return_memory,
          [this](const std::string& stage, const Runner::Words& words) {
            return words ? reworded(context(stage), words) : context(stage);
          }};
}

void Session::print_result(const std::string& text, const nlohmann::json& json) {
  terminal_.end_progress();  // it may stand on the same screen
  // File names need not be UTF-8; JSON must be.
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  write_to_stdout((flags_.json ? json.dump(2, ' ', false, kReplace) : text) + "\n");
}

void catch_signals() { stop_asked = &catch_stop_signals(); }

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
