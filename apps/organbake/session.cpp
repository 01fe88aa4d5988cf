// SPDX-License-Identifier: GPL-3.0-or-later
#include "session.h"

#include <tbb/global_control.h>

#include <atomic>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/stage_module.h"
#include "stop_signal.h"

namespace organbake {
namespace {

const std::atomic<bool>* stop_asked = nullptr;  // since catch_signals()

}  // namespace

struct Session::Threads {
  explicit Threads(int count) : limit(tbb::global_control::max_allowed_parallelism, count) {}
  tbb::global_control limit;
};

Session::Session() : shared_(shared_options()) {}
Session::~Session() = default;

OptionList Session::shared_options() {
  OptionList list;
  list.add("threads", &threads_,
           {.help = "at most this many threads; 0 = all. Results don't depend on it",
            .min = 0,
            .max = 4096})
      .add("json", &json_, {.help = "the result as JSON"})
      .add("quiet", &quiet_, {.help = "say nothing but warnings and errors"})
      .add("verbose", &verbose_, {.help = "say more"})
      .add("version", &version_, {.help = "print the version; with --json the libraries' too"})
      .add("help", &help_, {.help = "print this"});
  return list;
}

std::string Session::shared_help() const { return options_help(shared_); }

void Session::read_leading_flags(Arguments& arguments) {
  std::vector<std::string> notes;
  read_arguments(arguments, shared_, notes, true);
  obey_shared_flags();
}

void Session::obey_shared_flags() {
  terminal_.set_verbosity(verbose_ ? Verbosity::verbose
                          : quiet_ ? Verbosity::quiet
                                   : Verbosity::normal);
  if (threads_ > 0 && !thread_limit_) thread_limit_ = std::make_unique<Threads>(threads_);
}

std::optional<std::vector<std::string>> Session::read_command(Arguments arguments,
                                                              const std::string& usage,
                                                              const std::string& summary,
                                                              const OptionList& options,
                                                              std::size_t most_words) {
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
  if (help_) {
    const std::string own = options_help(options);
    write_to_stdout("organbake " + usage + "\n\n" + summary + "\n" +
                    (own.empty() ? "" : "\nOptions:\n") + own + "\nShared options:\n" +
                    shared_help());
    return std::nullopt;
  }
  if (words.size() > most_words) {
    throw UsageError("'" + words[most_words] + "' is one word too many; usage: organbake " + usage);
  }
  obey_shared_flags();
  for (const std::string& note : notes) terminal_.log(LogLevel::info, note);
  return words;
}

RunContext Session::context(const std::string& stage) {
  return {[this, stage](LogLevel level, std::string_view message) {
            terminal_.log(level, stage + ": " + std::string(message));
          },
          [this, stage](double fraction) { terminal_.progress(stage, fraction); }, stop_asked};
}

Runner Session::runner(const std::filesystem::path& cache_folder) {
  const std::filesystem::path folder =
      cache_folder.empty() ? Cache::default_folder() : cache_folder;
  if (cache_folder.empty() && folder == Cache::temporary_folder()) {
    terminal_.log(LogLevel::warning, "there is no home folder to write to; the cache is " +
                                         folder.string() + " (--cache or ORGANBAKE_CACHE)");
  }
  return {Cache(folder), run_in_module,
          [this](const std::string& stage) { return context(stage); }};
}

void Session::print_result(const std::string& text, const nlohmann::json& json) const {
  // File names need not be UTF-8; JSON must be.
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  write_to_stdout((json_ ? json.dump(2, ' ', false, kReplace) : text) + "\n");
}

void catch_signals() { stop_asked = &catch_stop_signals(); }

}  // namespace organbake
