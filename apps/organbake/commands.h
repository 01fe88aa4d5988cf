// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "command_line.h"
#include "organbake/core/parallel.h"
#include "organbake/core/run_context.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/runner.h"
#include "organbake/pipelines/stage.h"
#include "terminal.h"

namespace organbake {

// What every command has: the flags that all share, the log, Ctrl-C, the result on stdout.
class Session {
 public:
  Session();
  ~Session();

  Terminal& terminal() { return terminal_; }
  bool json() const { return flags_.json; }
  int threads() const { return flags_.threads; }  // 0 = all

  // The user's defaults, and the flags before the command's name; the first word left is the
  // command.
  void read_leading_flags(Arguments& arguments);
  bool help_asked() const { return flags_.help; }
  bool version_asked() const { return flags_.version; }

  // Reads a command's own arguments into `options`, the shared flags with them, and makes the
  // session obey those. Nothing when help was asked for and shown. `usage` is what stands after
  // "organbake "; `summary` one sentence; at most `most_words` words are taken. Throws UsageError
  // where there is none of a word that the command `needs` ("a bundle").
  std::optional<std::vector<std::string>> read_command(
      Arguments arguments, const std::string& usage, const std::string& summary,
      const OptionList& options, std::size_t most_words, const std::string& needs = "");
  std::string shared_help() const;

  // From now on commands do not run: read_command() fills `manual` with what they take (not with
  // their names and summaries, which it doesn't know) and returns nothing.
  void only_describe(CommandManual& manual) { described_ = &manual; }
  std::vector<ManualOption> shared_manual() const { return manual_options(shared_); }

  // For a task of this name, such as a stage.
  RunContext context(const std::string& task);
  // Steps run in modules, against the cache in `folder` (the user's own when empty). A flag goes
  // before ORGANBAKE_CACHE, and that before the configuration file.
  Runner runner(const std::filesystem::path& cache_folder);

  // The one result, on stdout: a path or a text, or under --json the JSON.
  void print_result(const std::string& text, const nlohmann::json& json);

 private:
  void obey_shared_flags();
  std::filesystem::path chosen_cache(const std::filesystem::path& asked) const;

  Terminal terminal_{"organbake"};
  SharedFlags flags_;
  OptionList shared_;  // after what it sets: it reads the defaults from there
  std::unique_ptr<ThreadLimit> thread_limit_;
  CommandManual* described_ = nullptr;
};

// SIGINT, SIGTERM and SIGHUP ask the running stage to stop; a second one ends the program at once.
void catch_signals();

// Each reads its arguments, does its work and returns the exit code; errors are thrown.
int run_stage_command(const Stage& stage, const Arguments& arguments, Session& session);
int run_bake(const Arguments& arguments, Session& session);
int run_batch(const Arguments& arguments, Session& session);
int run_plan(const Arguments& arguments, Session& session);
int run_inspect(const Arguments& arguments, Session& session);
int run_export(const Arguments& arguments, Session& session);
int run_new(const Arguments& arguments, Session& session);
int run_recipes(const Arguments& arguments, Session& session);
int run_materials(const Arguments& arguments, Session& session);
int run_report(const Arguments& arguments, Session& session);
int run_reseal(const Arguments& arguments, Session& session);
int run_verify(const Arguments& arguments, Session& session);
int run_schema(const Arguments& arguments, Session& session);
int run_doctor(const Arguments& arguments, Session& session);
int run_man(const Arguments& arguments, Session& session);
int run_completions(const Arguments& arguments, Session& session);

// What `organbake inspect` tells of a file or folder, read with inspect_options().
StageReport inspect(const std::filesystem::path& path, const StageOptions& reading,
                    Session& session);

// The commands that are no stages, in the order in which help lists them.
struct Verb {
  const char* name;
  const char* summary;
  int (*run)(const Arguments&, Session&);
  // What its words can be, for completions; else files.
  std::vector<std::string> (*known_words)() = nullptr;
};
std::span<const Verb> all_verbs();

inline constexpr std::size_t kMostCaseWords = 1'000'000;

// What `batch` and `plan` are told about the cases alike.
void add_case_flags(OptionList& list, BatchOptions& flags);

// The cases that the words name. Throws UsageError for what is missing: words, --recipe or -o.
std::vector<BatchCase> read_cases(const std::vector<std::string>& words, BatchOptions& flags,
                                  const std::string& command);
// What each is thought to need.
std::vector<CaseEstimate> estimates_of(const std::vector<BatchCase>& cases,
                                       const BatchOptions& flags, const RunContext& context);

// Creates the batch's folder with its logs. Throws IoError, also for a bundle's folder, which other
// files would damage.
void make_batch_folder(const std::filesystem::path& folder);
// Throws IoError when a table of cases among the words would be overwritten by `file`.
void check_spares_tables(const std::vector<std::string>& words, const std::filesystem::path& file);

// A stage's module that cannot be loaded, in the loader's words.
struct UnloadableModule {
  std::string file, reason;
};

// Loads the modules of all stages, which takes a good part of a second.
std::vector<UnloadableModule> unloadable_modules();

// The versions of the libraries that organbake works with: of the stages' by the files that are
// loaded now, so of all after unloadable_modules(); of the others, and of those that are headers
// alone, as they were when organbake was built.
std::map<std::string, std::string> library_versions();

}  // namespace organbake
