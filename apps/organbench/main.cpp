// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/nearest_name.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/schemas.h"
#include "report/compare_runs.h"
#include "report/machine.h"
#include "report/report_page.h"
#include "report/run_json.h"
#include "run_suite.h"
#include "stop_signal.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct Command {
  BenchOptions options;
  std::vector<std::string> suites;
  std::string out;
  std::vector<std::string> runs;  // of diff
  bool quick = false, thorough = false, quiet = false;

  Effort effort() const {
    return quick ? Effort::quick : thorough ? Effort::thorough : Effort::standard;
  }
};

RunContext context_for(const Command& command, const std::string& suite,
                       const std::atomic<bool>& stop_asked) {
  const auto log = [quiet = command.quiet, suite](LogLevel level, std::string_view message) {
    if (level == LogLevel::debug || (quiet && level != LogLevel::warning)) return;
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
      if (name == "stability" || name == "appearance")
        throw UsageError("the suite '" + name +
                         "' is among the acceptance tests now: run "
                         "scripts/test --acceptance");
      std::vector<std::string> known;
      for (const Suite& s : all) known.emplace_back(s.name);
      throw UsageError("unknown suite '" + name + "'" + suggestion(name, known) +
                       " (--help lists all)");
    }
    chosen.push_back(*found);
  }
  return chosen;
}

std::size_t missed(const SuiteResult& result) {
  return std::count_if(result.figures.begin(), result.figures.end(),
                       [](const Figure& f) { return !f.met(); });
}

int run_suites(const Command& command, const std::atomic<bool>& stop_asked) {
  if (command.out.empty()) throw UsageError("-o DIR is missing: where the page goes");
  const fs::path out = command.out;
  make_folder(out);  // before the work, not after it
  RunReport report{command.options.effort, describe_machine(), {}};
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
    context.info(std::to_string(result.points.size()) + " points, " +
                 std::to_string(result.figures.size() - missed(result)) + " of " +
                 std::to_string(result.figures.size()) + " figures reached, " +
                 to_text(passed.count(), 1) + " s");
    report.suites.push_back({suite.name, suite.summary, passed.count(), std::move(result)});
    if (stop_asked) break;  // what was found until now is kept
  }
  write_file_atomically(out / "organbench.json", nlohmann::json(report).dump(1) + "\n");
  write_file_atomically(out / "organbench.html", report_page(report));
  std::printf("%s\n", (out / "organbench.html").c_str());
  if (stop_asked) return static_cast<int>(ExitCode::interrupted);
  return static_cast<int>(failed ? ExitCode::batch_partial : ExitCode::ok);
}

RunReport read_run(const std::string& path) {
  const fs::path file =
      fs::is_directory(path) ? fs::path(path) / "organbench.json" : fs::path(path);
  check_json_file(file, "bench");
  return nlohmann::json::parse(read_text_file(file)).get<RunReport>();
}

int run_diff(const Command& command) {
  const Comparison comparison =
      compare_runs(read_run(command.runs.at(0)), read_run(command.runs.at(1)));
  const char* words[] = {"same  ", "better", "WORSE "};
  for (const Change& c : comparison.changes) {
    std::printf("%s  %6.3f×  %10.4g → %10.4g  %s\n", words[static_cast<int>(c.kind)],
                c.before != 0 ? c.after / c.before : 1.0, c.before, c.after, c.what.c_str());
  }
  for (const std::string& what : comparison.only_one)
    std::printf("only in one: %s\n", what.c_str());
  return static_cast<int>(comparison.regressed() ? ExitCode::quality_gate : ExitCode::ok);
}

std::string suite_list() {
  std::string text = "\nSuites:\n";
  for (const Suite& suite : all_suites()) {
    text += "  " + std::string(suite.name) + std::string(14 - std::string(suite.name).size(), ' ') +
            suite.summary + "\n";
  }
  return text;
}

int dispatch(int argc, char** argv, const std::atomic<bool>& stop_asked) {
  Command c;
  CLI::App app("organbench: run time against error, beside what others reach");
  app.add_option("SUITE", c.suites, "suites to run (default: all)");
  app.add_option("-o,--out", c.out, "folder for organbench.html and organbench.json");
  CLI::Option* quick =
      app.add_flag("--quick", c.quick, "small inputs, one round: two minutes for all suites");
  app.add_flag("--thorough", c.thorough,
               "every case a figure was promised for, and more rounds: an hour instead of the 20\n"
               "minutes for all suites")
      ->excludes(quick);
  app.add_option("--rounds", c.options.rounds,
                 "of every timing (default 9, or as many as 2 s allow; quick 1; thorough 9, or as\n"
                 "many, 3 at least, as 20 s allow)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--threads", c.options.threads, "threads to use, 0 = all")
      ->check(CLI::Range(0, 1024));
  app.add_option("--data", c.options.data, "folder of real data (CT, meshes, video)");
  app.add_option("--only", c.options.only,
                 "only this part of the suite registration; colmap: the suite motion with COLMAP\n"
                 "beside it; refit: fits the suite relief's model anew")
      ->check(CLI::IsMember({"colmap", "open patches", "refit", "time", "tracking"}));
  app.add_flag("--quiet", c.quiet, "no log");
  app.footer(suite_list());
  app.set_version_flag("--version", "organbench " ORGANBAKE_VERSION);
  CLI::App* diff = app.add_subcommand("diff", "compare two runs; exit code 3 on a regression");
  diff->add_option("RUN", c.runs, "the earlier and the later run: folders, or their JSON files")
      ->required()
      ->expected(2);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    app.exit(asked, std::cout, std::cerr);
    return 0;
  } catch (const CLI::ParseError& error) {
    throw UsageError(std::string(error.what()) + " (--help lists all)");
  }
  c.options.effort = c.effort();
  return diff->parsed() ? run_diff(c) : run_suites(c, stop_asked);
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
