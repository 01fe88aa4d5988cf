// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <chrono>

#include "bench.h"
#include "command_line.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "stop_signal.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct Command {
  BenchOptions options;
  std::vector<std::string> suites;
  std::string out;
  ManualFlags manuals;
  SharedFlags shared;
};

RunContext context_for(const Command& command, const std::string& suite,
                       const std::atomic<bool>& stop_asked) {
  const auto log = [flags = command.shared, suite](LogLevel level, std::string_view message) {
    if (flags.quiet && level != LogLevel::warning) return;
    if (!flags.verbose && level == LogLevel::debug) return;
    std::fprintf(stderr, "organbench: %s: %.*s\n", suite.c_str(), static_cast<int>(message.size()),
                 message.data());
  };
  return {log, {}, &stop_asked};
}

std::vector<Suite> chosen_suites(const std::vector<std::string>& names) {
  const std::vector<Suite> all = all_suites();
  if (names.empty()) return all;
  std::vector<Suite> chosen;
  for (const std::string& name : names) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Suite& s) { return s.name == name; });
    if (found == all.end()) {
      std::vector<std::string> known;
      for (const Suite& s : all) known.emplace_back(s.name);
      throw UsageError("unknown suite '" + name + "'" + suggestion(name, known) +
                       " (--help lists all)");
    }
    chosen.push_back(*found);
  }
  return chosen;
}

int run_suites(const Command& command, const std::atomic<bool>& stop_asked) {
  if (command.out.empty()) throw UsageError("-o DIR is missing: where organbench.json goes");
  const fs::path out = command.out;
  make_folder(out);  // before the work, not after it
  RunReport report{command.options.quick, describe_machine(), {}};
  bool failed = false;
  for (const Suite& suite : chosen_suites(command.suites)) {
    const auto start = std::chrono::steady_clock::now();
    const RunContext context = context_for(command, suite.name, stop_asked);
    SuiteResult result = run_suite(suite, command.options, context);
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
    if (!result.failure.empty()) {
      context.warn("ended early: " + result.failure);
      failed = true;
    }
    report.suites.push_back({suite.name, suite.summary, passed.count(), std::move(result)});
    write_to_stdout(suite_text(report.suites.back()));
    if (stop_asked) break;  // what was found until now is kept
  }
  write_file_atomically(out / "organbench.json", nlohmann::json(report).dump(1) + "\n");
  if (stop_asked) return static_cast<int>(ExitCode::interrupted);
  return static_cast<int>(failed ? ExitCode::batch_partial : ExitCode::ok);
}

OptionList option_list(Command& c) {
  OptionList list;
  list.add("out", &c.out,
           {.help = "folder for organbench.json", .value = "DIR", .short_flag = "-o"})
      .add("quick", &c.options.quick,
           {.help = "small inputs, one round: two minutes for all suites, else 20"})
      .add(
          "rounds", &c.options.rounds,
          {.help = "of every timing; else 9, or as many as 2 s allow; quick 1", .range = {1, 1000}})
      .add("data", &c.options.data,
           {.help = "folder of real data (CT, meshes, video)", .value = "DIR"});
  list.append(c.manuals.options());
  list.append(c.shared.options());
  return list;
}

constexpr const char* kSummary = "run time against error, beside what others reach";

CommandManual manual_of(const OptionList& options) {
  CommandManual manual{
      .program = "organbench",
      .summary = kSummary,
      .synopsis = "[SUITE…] -o DIR [OPTIONS]",
      .description =
          "Measures what organbake(1) and organplay(1) do: how much error remains in how much "
          "time, beside other programs on the same input. It tells its figures, and writes them as "
          "organbench.json into the folder of -o.",
      .options = manual_options(options),
      .sections = {{.title = "suites", .text = "Without a name, all of them run."},
                   exit_status_section()},
      .see_also = {"organbake", "organplay"}};
  for (const Suite& suite : all_suites()) {
    manual.sections.front().entries.emplace_back(suite.name, suite.summary);
    manual.words.emplace_back(suite.name);
  }
  return manual;
}

std::string help(const OptionList& options) {
  std::string text =
      std::string("organbench: ") + kSummary +
      "\n\nusage: organbench [SUITE…] -o DIR [OPTIONS]   (no SUITE: all of them)\n\nSuites:\n";
  for (const Suite& suite : all_suites()) {
    text += "  " + std::string(suite.name) + std::string(14 - std::string(suite.name).size(), ' ') +
            suite.summary + "\n";
  }
  return text + options_help(options);
}

int dispatch(int argc, char** argv, const std::atomic<bool>& stop_asked) {
  Command c;
  c.shared.read_defaults();
  const OptionList options = option_list(c);
  std::vector<std::string> arguments(argv + 1, argv + argc), notes;
  c.suites = read_arguments(arguments, options, notes);
  if (c.shared.help || c.shared.version) {
    write_to_stdout(c.shared.help ? help(options) : version_text("organbench", c.shared.json));
    return 0;
  }
  if (const auto text = c.manuals.text(manual_of(options))) {
    write_to_stdout(*text);
    return 0;
  }
  c.options.threads = c.shared.threads;
  return run_suites(c, stop_asked);
}

int run(int argc, char** argv) {
  try {
    return dispatch(argc, argv, catch_stop_signals());
  } catch (const std::exception& error) {
    const ExitCode code = exit_code_for(error);
    std::fprintf(stderr, "organbench: error: %s\n", error.what());
    return static_cast<int>(code);
  }
}

}  // namespace
}  // namespace organbake

int main(int argc, char** argv) { return organbake::run(argc, argv); }
