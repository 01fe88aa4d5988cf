// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/error.h"
#include "core/files.h"
#include "core/text.h"
#include "organbake/commands.h"
#include "pipelines/batch_cases.h"
#include "pipelines/batch_report.h"
#include "pipelines/worker_process.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using BatchClock = std::chrono::steady_clock;

struct BatchFlags {
  fs::path recipe, output, cache;
  std::string input = "ct", shard = "1/1";
  std::vector<std::string> settings;
  int jobs = 1;
  bool keep_going = true, pictures = true, progress_json = false;
};

OptionList batch_flag_list(BatchFlags& flags) {
  OptionList list;
  list.add("recipe", &flags.recipe, {.help = "what to bake every case with"})
      .add("output", &flags.output, {.help = "-o: folder that gets a folder for each case"})
      .add("as", &flags.input, {.help = "the recipe's input that files given by name are"})
      .add("set", &flags.settings,
           {.help = "key=value for all cases, repeatable; a case's own settings go first"})
      .add("jobs", &flags.jobs,
           {.help = "cases baked at once; they share the threads", .min = 1, .max = 1024})
      .add("shard", &flags.shard, {.help = "I/N: only every N-th case, from the I-th on"})
      .add("keep_going", &flags.keep_going, {.help = "go on when a case failed"})
      .add("pictures", &flags.pictures, {.help = "a picture of every organ, for the page"})
      .add("progress_json", &flags.progress_json,
           {.help = "a line of JSON on stderr whenever a case ends"})
      .add("cache", &flags.cache, {.help = "folder of the cache"});
  return list;
}

// One table, or files by name: the shell has expanded a pattern already.
std::vector<BatchCase> cases_from(const std::vector<std::string>& words, const BatchFlags& flags) {
  const bool table = words.size() == 1 && fs::path(words[0]).extension() == ".csv";
  return table ? read_case_table(words[0]) : cases_of_files(words, flags.input);
}

std::string last_line(const fs::path& file) {
  std::string text = read_text_file(file);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  text = text.substr(text.rfind('\n') + 1);
  const std::string prefix = "organbake: error: ";
  return text.rfind(prefix, 0) == 0 ? text.substr(prefix.size()) : text;
}

// Workers over the cases of a batch, a row for each.
class Batch {
 public:
  Batch(const BatchFlags& flags, std::vector<BatchCase> cases, Session& session)
      : flags_(flags),
        cases_(std::move(cases)),
        session_(session),
        logs_(flags.output / "logs"),
        pictures_(flags.output / "pictures") {
    for (const BatchCase& one : cases_) {
      rows_.push_back({one.name, "not started", int(ExitCode::batch_partial), 0, 0, {}, {}, {}});
    }
  }

  std::vector<BatchRow> run(int threads) {
    if (flags_.pictures) fs::create_directories(pictures_);
    const RunContext context = session_.context("batch");
    std::size_t next = 0;
    bool stopped = false;
    while (next < cases_.size() || !running_.empty()) {
      stopped |= context.cancelled();
      while (!stopped && next < cases_.size() && int(running_.size()) < flags_.jobs) {
        start(next++, threads);
      }
      if (running_.empty()) break;
      const std::size_t ended = collect(wait_for_any_worker());
      tell(ended);
      stopped |= !flags_.keep_going && rows_[ended].exit_code != 0;
    }
    context.throw_if_cancelled();
    return rows_;
  }

 private:
  struct Worker {
    std::size_t index;
    BatchClock::time_point started;
  };

  void start(std::size_t index, int threads) {
    const BatchCase& one = cases_[index];
    std::vector<std::string> command = {(program_folder() / "organbake").string(),
                                        "bake",
                                        flags_.recipe.string(),
                                        "-o",
                                        (flags_.output / one.name).string(),
                                        "--json",
                                        "--quiet",
                                        "--threads",
                                        std::to_string(threads)};
    for (const auto* settings : {&flags_.settings, &one.settings}) {
      for (const std::string& setting : *settings) {
        command.insert(command.end(), {"--set", setting});
      }
    }
    if (!flags_.cache.empty()) command.insert(command.end(), {"--cache", flags_.cache.string()});
    const pid_t process =
        start_worker(command, logs_ / (one.name + ".json"), logs_ / (one.name + ".log"));
    running_[process] = {index, BatchClock::now()};
  }

  std::size_t collect(const WorkerEnd& end) {
    const auto found = running_.find(end.process);
    if (found == running_.end()) throw std::logic_error("batch: an unknown worker ended");
    const Worker worker = found->second;
    running_.erase(found);
    BatchRow& row = rows_[worker.index];
    row.seconds = std::chrono::duration<double>(BatchClock::now() - worker.started).count();
    row.exit_code = end.exit_code;
    row.peak_mb = end.peak_mb;
    if (end.exit_code == 0) {
      describe_success(row);
    } else {
      row.status = "failed";
      row.error = last_line(logs_ / (row.name + ".log"));
      if (end.signal != 0) row.error = std::string("killed by ") + ::strsignal(end.signal);
    }
    return worker.index;
  }

  void describe_success(BatchRow& row) {
    const fs::path bundle = flags_.output / row.name;
    const auto result = nlohmann::json::parse(read_text_file(logs_ / (row.name + ".json")));
    row.status = result.at("state").get<std::string>();
    row.figures = key_figures(nlohmann::json::parse(read_text_file(bundle / "report.json")));
    if (flags_.pictures) row.picture = picture_of(row, bundle);
  }

  // The player is another program, and need not be installed.
  std::string picture_of(const BatchRow& row, const fs::path& bundle) {
    const fs::path file = pictures_ / (row.name + ".png"), player = program_folder() / "organplay";
    if (row.status == "unchanged" && fs::exists(file)) return "pictures/" + row.name + ".png";
    if (!fs::exists(player)) return {};
    const pid_t process = start_worker(
        {player.string(), bundle.string(), "-o", file.string(), "--size", "240x180", "--quiet"},
        "/dev/null", logs_ / (row.name + ".picture.log"));
    return wait_for_worker(process).exit_code == 0 ? "pictures/" + row.name + ".png" : "";
  }

  void tell(std::size_t ended) {
    const BatchRow& row = rows_[ended];
    ++done_;
    failed_ += row.exit_code != 0;
    const double passed = std::chrono::duration<double>(BatchClock::now() - begun_).count();
    const double left = passed / double(done_) * double(cases_.size() - done_);
    if (flags_.progress_json) {
      const nlohmann::json line = {
          {"done", done_},          {"failed", failed_}, {"running", running_.size()},
          {"cases", cases_.size()}, {"case", row.name},  {"status", row.status},
          {"seconds_left", left}};
      const auto text = line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
      std::fwrite(text.data(), 1, text.size(), stderr);
      return;
    }
    const std::string place = std::to_string(done_) + " of " + std::to_string(cases_.size());
    const std::string text =
        place + ": " + row.name + ": " + row.status + " in " + to_text(row.seconds, 2) + " s" +
        (row.error.empty() ? "" : ": " + row.error) + " (" + to_text(left, 0) + " s left)";
    session_.terminal().log(row.exit_code == 0 ? LogLevel::info : LogLevel::warning, text);
  }

  const BatchFlags& flags_;
  std::vector<BatchCase> cases_;
  Session& session_;
  fs::path logs_, pictures_;
  std::vector<BatchRow> rows_;
  std::map<pid_t, Worker> running_;
  BatchClock::time_point begun_ = BatchClock::now();
  std::size_t done_ = 0, failed_ = 0;
};

// Shards write beside each other.
std::string report_stem(const Shard& shard) {
  if (shard.count == 1) return "batch";
  return "batch-" + std::to_string(shard.index) + "-of-" + std::to_string(shard.count);
}

void make_batch_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder / "logs", error);
  if (!fs::is_directory(folder / "logs")) {
    throw IoError::writing(folder, error ? error.message() : "is a file; name a folder");
  }
}

// Held as long as the process lives: two that bake the same cases would mix up their logs.
void lock_batch(const fs::path& folder, const std::string& stem) {
  const fs::path file = folder / "logs" / (stem + ".lock");
  constexpr mode_t kMode = 0666;
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kMode);
  if (fd < 0) throw IoError::writing(file, std::strerror(errno));
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return;
  throw Error(ExitCode::try_again,
              folder.string() + ": another batch is at work here; wait for it, or name another -o");
}

}  // namespace

int run_batch(const Arguments& arguments, Session& session) {
  BatchFlags flags;
  constexpr std::size_t kMostFiles = 1'000'000;
  const auto words = session.read_command(
      arguments, "batch CASES.csv|FILE… --recipe RECIPE -o DIR [OPTIONS]",
      "Bakes many cases by one recipe, each in a process of its own. Run again, it does what is "
      "missing, failed or changed.\n\nCASES.csv has a column 'case' and a column for every key "
      "that differs: case,ct,mask,label",
      batch_flag_list(flags), kMostFiles);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake batch' needs a table of cases, or files");
  if (flags.recipe.empty()) throw UsageError("--recipe is missing: how shall the cases be baked?");
  if (flags.output.empty()) throw UsageError("-o is missing: where shall the bundles go?");
  if (!fs::exists(flags.recipe)) throw NoInputError(flags.recipe, "does not exist");
  const Shard shard = parse_shard(flags.shard);
  const std::vector<BatchCase> cases = cases_of_shard(cases_from(*words, flags), shard);
  const std::string stem = report_stem(shard), recipe = flags.recipe.filename().string();
  make_batch_folder(flags.output);
  lock_batch(flags.output, stem);

  const int available =
      session.threads() > 0 ? session.threads() : int(std::thread::hardware_concurrency());
  Batch batch(flags, cases, session);
  const std::vector<BatchRow> rows = batch.run(std::max(1, available / flags.jobs));
  const nlohmann::json json = batch_json(recipe, rows);
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  write_file_atomically(flags.output / (stem + ".json"), json.dump(2, ' ', false, kReplace) + "\n");
  write_file_atomically(flags.output / (stem + ".csv"), batch_csv(rows));
  write_file_atomically(flags.output / (stem + ".html"), batch_page(recipe, rows));
  session.print_result((flags.output / (stem + ".html")).string(), json);
  const bool all =
      std::all_of(rows.begin(), rows.end(), [](const BatchRow& row) { return row.exit_code == 0; });
  return static_cast<int>(all ? ExitCode::ok : ExitCode::batch_partial);
}

}  // namespace organbake
