// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "command_line.h"
#include "organbake/core/parallel.h"
#include "organbake/pipelines/runner.h"
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

}  // namespace organbake
