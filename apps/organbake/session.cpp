// SPDX-License-Identifier: GPL-3.0-or-later
// What all commands share: messages, progress, signals, the cache's folder.
#include "session.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/stage.h"
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

}  // namespace organbake
