// SPDX-License-Identifier: GPL-3.0-or-later
// organbake batch, and what it and plan are told of the cases alike.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/processes.h"
#include "organbake/pipelines/recipe.h"

namespace organbake {
namespace fs = std::filesystem;

void add_case_flags(OptionList& list, BatchOptions& flags) {
  list.add("recipe", &flags.recipe,
           {.help = "what to bake every case with: a file, or one of 'organbake recipes' by name",
            .suggestions = known_recipe_names(),
            .value = "RECIPE"})
      .add("output", &flags.output,
           {.help = "folder that gets a folder for each case", .value = "DIR", .short_flag = "-o"})
      .add("as", &flags.input,
           {.help = "the recipe's input that files given by name are", .value = "INPUT"})
      .add("set", &flags.settings,
           {.help = "for all cases, repeatable; a case's own settings go first",
            .value = "KEY=VALUE"})
      .add("pictures", &flags.pictures, {.help = "a picture of every organ, for the page"})
      .add("web", &flags.web,
           {.help = "a page for every organ in which anyone can poke it; the batch's links to it"})
      .add("strict", &flags.strict,
           {.help = "a case whose stages warned of something ends with exit code 3, written"})
      .add("memory", &flags.memory_mb,
           {.help = "what the cases under way may need; 0 = what this machine has",
            .unit = "MB",
            .range = {0, 1e9}})
      .add("cache", &flags.cache, {.help = "folder of the cache", .value = "DIR"});
}

std::vector<BatchCase> read_cases(const std::vector<std::string>& words, BatchOptions& flags,
                                  const std::string& command) {
  if (words.empty()) {
    throw UsageError("'organbake " + command + "' needs a table of cases, files, or a pattern");
  }
  if (flags.recipe.empty()) throw UsageError("--recipe is missing: how shall the cases be baked?");
  if (flags.output.empty()) throw UsageError("-o is missing: where shall the bundles go?");
  flags.recipe = recipe_file(flags.recipe.string());
  return cases_of_words(words, flags.input);
}

std::vector<CaseEstimate> estimates_of(const std::vector<BatchCase>& cases,
                                       const BatchOptions& flags, const RunContext& context) {
  std::vector<CaseEstimate> estimates;
  for (const BatchCase& one : cases) {
    context.throw_if_cancelled();
    std::vector<std::string> settings = flags.settings;
    settings.insert(settings.end(), one.settings.begin(), one.settings.end());
    estimates.push_back(estimate_case(flags.recipe, settings));
  }
  return estimates;
}

void check_spares_tables(const std::vector<std::string>& words, const fs::path& file) {
  std::error_code ignored;
  for (const std::string& word : words) {
    if (!fs::equivalent(word, file, ignored)) continue;
    throw IoError::writing(file,
                           "is the table of cases, and would be overwritten by one of that "
                           "name; rename it or name another -o");
  }
}

void make_batch_folder(const fs::path& folder) {
  if (fs::exists(folder / "manifest.json"))
    throw IoError::writing(folder, "is a bundle; name another folder for the cases");
  std::error_code error;
  fs::create_directories(folder / "logs", error);
  if (!fs::is_directory(folder / "logs")) {
    throw IoError::writing(folder, error ? error.message() : "is a file; name a folder");
  }
}

namespace {

using Json = nlohmann::json;

constexpr auto kReplace = Json::error_handler_t::replace;  // file names need not be UTF-8

struct BatchFlags {
  BatchOptions cases;
  std::string shard, progress = "text";
  int gather = 0;
};

OptionList batch_flag_list(BatchFlags& flags) {
  OptionList list;
  add_case_flags(list, flags.cases);
  list.add("jobs", &flags.cases.jobs,
           {.help = "cases at once, as far as memory allows; they share the threads",
            .range = {1, 1024}})
      .add("shard", &flags.shard,
           {.help = "only every N-th case, from the I-th on", .value = "I/N"})
      .add("gather", &flags.gather,
           {.help = "bake nothing: join the results of N shards to one table and page",
            .range = {0, 1'000'000}})
      .add("keep_going", &flags.cases.keep_going, {.help = "go on when a case failed"})
      .add("progress", &flags.progress,
           {.help = "how to tell on stderr what goes on: for people, or a JSON object a line",
            .choices = {"text", "json"}});
  return list;
}

// Shards write beside each other.
std::string report_stem(const Shard& shard) {
  return "batch-" + std::to_string(shard.index) + "-of-" + std::to_string(shard.count);
}

// Two that bake the same cases would mix up their logs. The workers inherit the lock: after a batch
// was killed the next one waits until they are gone, too, for they die a moment later.
LockOptions batch_lock(const fs::path& folder, const std::string& stem) {
  constexpr std::chrono::seconds kPatience{3};
  return {
      .file = folder / "logs" / (stem + ".lock"),
      .inherited = true,
      .patience = kPatience,
      .busy = folder.string() + ": another batch is at work here; wait for it, or name another -o"};
}

void tell_program(const BatchProgress& now) {
  using Event = BatchProgress::Event;
  const bool started = now.event == Event::started;
  const char* const event = started ? "started" : now.event == Event::again ? "again" : "ended";
  const Json line = {{"event", event},
                     {"case", now.row.name},
                     {"status", started ? "running" : now.row.status},
                     {"warnings", now.row.warnings},
                     {"cases", now.cases},
                     {"done", now.done},
                     {"failed", now.failed},
                     {"running", now.running},
                     {"seconds_left", now.seconds_left}};
  const std::string text = line.dump(-1, ' ', false, kReplace) + "\n";
  std::fwrite(text.data(), 1, text.size(), stderr);
}

void tell_people(const BatchProgress& now, Terminal& terminal) {
  terminal.progress("batch", double(now.done) / double(now.cases));
  if (now.event == BatchProgress::Event::started) return;
  const BatchRow& row = now.row;
  if (now.event == BatchProgress::Event::again) {
    terminal.log(LogLevel::warning, "batch: " + row.name + ": " + row.error +
                                        "; it is tried once more at the end, alone");
    return;
  }
  for (const std::string& warning : row.warnings)
    terminal.log(LogLevel::warning, "batch: " + row.name + ": " + warning);
  std::string text = std::to_string(now.done) + " of " + std::to_string(now.cases) + ": " +
                     row.name + ": " + row.status + " in " + to_text(row.seconds, 2) + " s";
  if (!row.error.empty()) text += ": " + row.error;
  text += " (" + std::to_string(now.running) + " running, " + std::to_string(now.failed) +
          " failed, about " + to_text(now.seconds_left, 0) + " s left)";
  terminal.log(row.exit_code == 0 ? LogLevel::info : LogLevel::warning, text);
}

std::function<void(const BatchProgress&)> listener(const std::string& progress,
                                                   Terminal& terminal) {
  if (progress == "json") return tell_program;
  return [&terminal](const BatchProgress& now) { tell_people(now, terminal); };
}

// The cases under way share the machine, or what is given of it.
void share_out(BatchOptions& cases, const Session& session) {
  const int available =
      session.threads() > 0 ? session.threads() : int(std::thread::hardware_concurrency());
  cases.threads = std::max(1, available / cases.jobs);
  if (cases.memory_mb <= 0) cases.memory_mb = machine_memory().available_mb;
}

// Nobody needs an estimate of what has the machine to itself.
std::vector<double> memory_needed(const std::vector<BatchCase>& cases, const BatchOptions& flags,
                                  const RunContext& context) {
  std::vector<double> memory_mb(cases.size());
  if (flags.jobs == 1) return memory_mb;
  const std::vector<CaseEstimate> estimates = estimates_of(cases, flags, context);
  std::transform(estimates.begin(), estimates.end(), memory_mb.begin(),
                 [](const CaseEstimate& estimate) { return estimate.memory_mb; });
  return memory_mb;
}

void write_reports(const fs::path& stem, const std::string& recipe,
                   const std::vector<BatchRow>& rows, Session& session) {
  const auto with = [&](const char* ending) { return fs::path(stem.string() + ending); };
  const Json json = batch_json(recipe, rows);
  write_file_atomically(with(".csv"), batch_csv(rows));
  write_file_atomically(with(".html"), batch_page(recipe, rows));
  write_file_atomically(with(".json"), json.dump(2, ' ', false, kReplace) + "\n");
  session.print_result(with(".html").string(), json);
}

int gather(const BatchFlags& flags, Session& session) {
  if (flags.cases.output.empty()) throw UsageError("-o is missing: which batch shall be joined?");
  std::vector<std::vector<BatchRow>> shards;
  std::string recipe;
  for (std::size_t i = 1; i <= std::size_t(flags.gather); ++i) {
    const fs::path file =
        flags.cases.output / (report_stem({i, std::size_t(flags.gather)}) + ".json");
    if (!fs::exists(file)) throw NoInputError(file, "is missing: that shard has not ended yet");
    check_json_file(file, "batch");
    const Json json = Json::parse(read_text_file(file));
    recipe = json.at("recipe");
    shards.push_back(rows_of(json));
  }
  const std::vector<BatchRow> rows = interleaved(shards);
  write_reports(flags.cases.output / "batch", recipe, rows, session);
  return static_cast<int>(exit_code_of(rows));
}

int bake_cases(const std::vector<std::string>& words, BatchFlags& flags, Session& session) {
  const Shard shard = flags.shard.empty() ? Shard{} : parse_shard(flags.shard);
  const auto given = cases_of_shard(read_cases(words, flags.cases, "batch"), shard);
  const fs::path& output = flags.cases.output;
  const std::string stem = flags.shard.empty() ? "batch" : report_stem(shard);
  check_spares_tables(words, output / (stem + ".csv"));
  make_batch_folder(output);
  const RunContext context = session.context("batch");
  const FileLock lock(batch_lock(output, stem), context);
  const auto [cases, left_out] =
      cases_of_spans(given, flags.cases.recipe, flags.cases.settings, output, context);
  share_out(flags.cases, session);
  std::vector<BatchRow> rows =
      bake_batch(flags.cases, cases, memory_needed(cases, flags.cases, context),
                 listener(flags.progress, session.terminal()), context);
  rows.insert(rows.end(), left_out.begin(), left_out.end());
  write_reports(output / stem, flags.cases.recipe.filename().string(), rows, session);
  context.throw_if_cancelled();
  return static_cast<int>(exit_code_of(rows));
}

}  // namespace

int run_batch(const Arguments& arguments, Session& session) {
  BatchFlags flags;
  const auto words = session.read_command(
      arguments, "batch CASES.csv|FILE…|PATTERN… --recipe RECIPE -o DIR [OPTIONS]",
      "Bakes many cases by one recipe, each in a process of its own. Run again, it does what is "
      "missing, failed or changed.\n\nCASES.csv has a column 'case' and a column for every key "
      "that differs: case,ct,mask,label. A PATTERN in quotes ('archive/**/*.mp4') is expanded "
      "here, '**' to any number of folders.",
      batch_flag_list(flags), kMostCaseWords);
  if (!words) return 0;
  return flags.gather > 0 ? gather(flags, session) : bake_cases(*words, flags, session);
}

}  // namespace organbake
