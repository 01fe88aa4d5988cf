// SPDX-License-Identifier: GPL-3.0-or-later
// Bakes the cases of a batch, each in a process of its own, as many at once as memory allows;
// starts, watches and ends those processes.
#include "organbake/pipelines/batch_run.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "organbake/core/files.h"
#include "organbake/pipelines/processes.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr int kCannotRun = 127;  // as shells say it

// In a child process, right after the fork: it ends with its parent, however that ends.
void end_with_parent(pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCannotRun);  // it was killed before we could ask
}

// Only what is allowed between fork and exec in a process that may have threads.
[[noreturn]] void become(char* const* arguments, int out, int error, pid_t parent) {
  end_with_parent(parent);
  const int nothing = ::open("/dev/null", O_RDONLY);
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(error, STDERR_FILENO);
  ::execv(arguments[0], arguments);
  ::_exit(kCannotRun);
}

int open_for_writing(const std::filesystem::path& file) {
  constexpr mode_t kMode = 0666;
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  if (fd < 0) throw IoError::writing(file, std::strerror(errno));
  return fd;
}

// Starts a program with stdout and stderr sent to files, its stdin empty. It ends with this
// process, however that ends, so that nothing writes on behind a batch that was killed.
pid_t start_worker(const std::vector<std::string>& command, const std::filesystem::path& out_file,
                   const std::filesystem::path& error_file) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const int out = open_for_writing(out_file), error = open_for_writing(error_file);
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process == 0) become(arguments.data(), out, error, parent);
  ::close(out);
  ::close(error);
  if (process < 0) {
    throw Error(ExitCode::try_again,
                std::string("no process can be started: ") + std::strerror(errno));
  }
  return process;
}

// Waits until any worker ends; nothing when a signal came first.
std::optional<WorkerEnd> wait_for_any_worker() {
  int status = 0;
  rusage usage{};
  const pid_t process = ::wait4(-1, &status, 0, &usage);
  if (process < 0 && errno == EINTR) return std::nullopt;
  if (process < 0) throw std::logic_error("wait_for_any_worker: there is none");
  constexpr double kKbPerMb = 1024;
  WorkerEnd end{process, 0, 0, double(usage.ru_maxrss) / kKbPerMb};
  if (WIFSIGNALED(status)) {
    end.signal = WTERMSIG(status);
    end.exit_code = 128 + end.signal;
  } else {
    end.exit_code = WEXITSTATUS(status);
  }
  return end;
}

constexpr int kSignalBase = 128;  // exit codes of what a signal ended, as shells count

// Signals that come from outside: the system short of memory, an operator, a cluster that takes its
// node back. Others (a crash) are a defect, and would come again.
bool is_passing(int exit_code) {
  return exit_code == static_cast<int>(ExitCode::try_again) || exit_code == kSignalBase + SIGKILL ||
         exit_code == kSignalBase + SIGTERM;
}

std::string last_words(const fs::path& log) {
  std::string text = read_text_file(log);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  text = text.substr(text.rfind('\n') + 1);
  const std::string prefix = "organbake: error: ";
  return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
}

std::string death_by(int signal) {
  const std::string text =
      std::string("killed by signal ") + std::to_string(signal) + " (" + ::strsignal(signal) + ")";
  return signal == SIGKILL ? text + "; if nobody did, memory was short: try fewer --jobs" : text;
}

class Batch {
 public:
  Batch(const BatchOptions& options, const std::vector<BatchCase>& cases,
        const std::vector<double>& memory_mb,
        const std::function<void(const BatchProgress&)>& listener, const RunContext& context)
      : options_(options),
        cases_(cases),
        memory_mb_(memory_mb),
        listener_(listener),
        context_(context) {
    for (const BatchCase& one : cases_) {
      waiting_.push_back(rows_.size());
      rows_.push_back(
          {one.name, "not started", int(ExitCode::batch_partial), 0, 0, {}, {}, {}, {}, {}});
    }
  }

  std::vector<BatchRow> run() {
    if (options_.pictures) make_folder(options_.output / "pictures");
    if (options_.web) make_folder(options_.output / "pages");
    while (true) {
      if (context_.cancelled()) stop_workers();
      while (may_start()) start_next();
      if (running_.empty()) return rows_;
      if (const auto end = wait_for_any_worker()) collect(*end);
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Task { bake, picture, page };
  struct Worker {
    std::size_t index;
    Task task;
    Clock::time_point started;
  };

  bool may_start() const {
    if (stopped_) return false;
    if (running_.empty()) return !waiting_.empty() || !again_.empty();
    if (waiting_.empty() || int(running_.size()) >= options_.jobs) return false;
    double needed_mb = memory_mb_[waiting_.front()];
    for (const auto& [process, worker] : running_) needed_mb += memory_mb_[worker.index];
    return options_.memory_mb <= 0 || needed_mb <= options_.memory_mb;
  }

  void start_next() {
    std::deque<std::size_t>& queue = waiting_.empty() ? again_ : waiting_;
    const std::size_t index = queue.front();
    queue.pop_front();
    const BatchRow& row = rows_[index];
    const pid_t process =
        start_worker(bake_command(cases_[index]), log_of(row, ".json"), log_of(row, ".log"));
    running_[process] = {index, Task::bake, Clock::now()};
    tell(index, BatchProgress::Event::started);
  }

  std::vector<std::string> bake_command(const BatchCase& one) const {
    const std::string program = program_folder() / "organbake", output = options_.output / one.name;
    std::vector<std::string> command = {program,   "bake",      options_.recipe,
                                        "-o",      output,      "--json",
                                        "--quiet", "--threads", std::to_string(options_.threads)};
    for (const auto* settings : {&options_.settings, &one.settings}) {
      for (const std::string& setting : *settings)
        command.insert(command.end(), {"--set", setting});
    }
    if (options_.strict) command.emplace_back("--strict");
    if (!options_.cache.empty())
      command.insert(command.end(), {"--cache", options_.cache.string()});
    return command;
  }

  void stop_workers() {
    stopped_ = true;
    if (std::exchange(workers_told_, true)) return;
    for (const auto& [process, worker] : running_) ::kill(process, SIGTERM);
  }

  void collect(const WorkerEnd& end) {
    const auto found = running_.find(end.process);
    if (found == running_.end()) throw std::logic_error("batch: an unknown worker ended");
    const Worker worker = found->second;
    running_.erase(found);
    BatchRow& row = rows_[worker.index];
    row.seconds += std::chrono::duration<double>(Clock::now() - worker.started).count();
    row.peak_mb = std::max(row.peak_mb, end.peak_mb);
    if (worker.task == Task::bake) return end_bake(worker.index, end);
    if (end.exit_code == 0) extra_of(row, worker.task) = extra_file(row, worker.task);
    if (worker.task == Task::page || !start_extra(worker.index, Task::page)) finish(worker.index);
  }

  void end_bake(std::size_t index, const WorkerEnd& end) {
    BatchRow& row = rows_[index];
    row.exit_code = end.exit_code;
    if (end.exit_code == 0 || end.exit_code == int(ExitCode::quality_gate)) {
      describe_success(row);
      if (!start_extra(index, Task::picture)) finish(index);
      return;
    }
    row.status = "failed";
    row.error = end.signal != 0 ? death_by(end.signal) : last_words(log_of(row, ".log"));
    if (!try_again(index)) finish(index);
  }

  void describe_success(BatchRow& row) {
    const auto result = nlohmann::json::parse(read_text_file(log_of(row, ".json")));
    const fs::path report = options_.output / row.name / "report.json";
    row.status = result.at("state").get<std::string>();
    row.figures = key_figures(nlohmann::json::parse(read_text_file(report)));
    row.warnings = result.at("warnings");
    row.error.clear();
    if (row.exit_code != 0) row.error = "the bundle is written, but there were warnings (--strict)";
  }

  bool start_extra(std::size_t index, Task first) {
    BatchRow& row = rows_[index];
    for (const Task task : {Task::picture, Task::page}) {
      if (task < first || !(task == Task::picture ? options_.pictures : options_.web)) continue;
      const std::vector<std::string> command = extra_command(row, task);
      if (!fs::exists(command.front())) continue;  // the player need not be installed
      if (row.status == "unchanged" && fs::exists(options_.output / extra_file(row, task))) {
        extra_of(row, task) = extra_file(row, task);
        continue;
      }
      const char* const log = task == Task::picture ? ".picture.log" : ".page.log";
      running_[start_worker(command, "/dev/null", log_of(row, log))] = {index, task, Clock::now()};
      return true;
    }
    return false;
  }

  std::vector<std::string> extra_command(const BatchRow& row, Task task) const {
    const bool picture = task == Task::picture;
    const std::string bundle = (options_.output / row.name).string();
    std::vector<std::string> command = {
        (program_folder() / (picture ? "organplay" : "organbake")).string()};
    if (picture) command.insert(command.end(), {bundle, "--size", "240x180"});
    if (!picture) command.insert(command.end(), {"export", bundle, "--format", "web"});
    command.insert(command.end(), {"-o", (options_.output / extra_file(row, task)).string(),
                                   "--quiet", "--threads", std::to_string(options_.threads)});
    return command;
  }

  // Relative to the batch's folder.
  static std::string extra_file(const BatchRow& row, Task task) {
    return task == Task::picture ? "pictures/" + row.name + ".png" : "pages/" + row.name + ".html";
  }

  bool try_again(std::size_t index) {
    const BatchRow& row = rows_[index];
    if (stopped_ || context_.cancelled() || !is_passing(row.exit_code)) return false;
    if (!tried_again_.insert(index).second) return false;
    tell(index, BatchProgress::Event::again);
    again_.push_back(index);
    return true;
  }

  void finish(std::size_t index) {
    ++done_;
    const bool failed = rows_[index].exit_code != 0;
    failed_ += failed;
    tell(index, BatchProgress::Event::ended);
    stopped_ |= failed && !options_.keep_going;
  }

  void tell(std::size_t index, BatchProgress::Event event) const {
    const double passed = std::chrono::duration<double>(Clock::now() - begun_).count();
    const double left = done_ == 0 ? 0 : passed / double(done_) * double(rows_.size() - done_);
    listener_({event, rows_.size(), done_, failed_, running_.size(), left, rows_[index]});
  }

  fs::path log_of(const BatchRow& row, const std::string& ending) const {
    return options_.output / "logs" / (row.name + ending);
  }

  static std::string& extra_of(BatchRow& row, Task task) {
    return task == Task::picture ? row.picture : row.page;
  }

  const BatchOptions& options_;
  const std::vector<BatchCase>& cases_;
  const std::vector<double>& memory_mb_;
  const std::function<void(const BatchProgress&)>& listener_;
  const RunContext& context_;
  std::vector<BatchRow> rows_;
  std::deque<std::size_t> waiting_, again_;
  std::set<std::size_t> tried_again_;
  std::map<pid_t, Worker> running_;
  Clock::time_point begun_ = Clock::now();
  std::size_t done_ = 0, failed_ = 0;
  bool stopped_ = false;       // no more cases are started
  bool workers_told_ = false;  // to stop
};

}  // namespace

ExitCode exit_code_of(const std::vector<BatchRow>& rows) {
  const auto any = [&](auto holds) { return std::any_of(rows.begin(), rows.end(), holds); };
  if (any([](const BatchRow& row) { return is_passing(row.exit_code); })) {
    return ExitCode::try_again;
  }
  return any([](const BatchRow& row) { return row.exit_code != 0; }) ? ExitCode::batch_partial
                                                                     : ExitCode::ok;
}

std::vector<BatchRow> bake_batch(const BatchOptions& options, const std::vector<BatchCase>& cases,
                                 const std::vector<double>& memory_mb,
                                 const std::function<void(const BatchProgress&)>& listener,
                                 const RunContext& context) {
  return Batch(options, cases, memory_mb, listener, context).run();
}

WorkerEnd run_worker(const std::vector<std::string>& command, const std::filesystem::path& out_file,
                     const std::filesystem::path& error_file, const RunContext& context) {
  start_worker(command, out_file, error_file);
  std::optional<WorkerEnd> end;
  while (!(end = wait_for_any_worker())) context.throw_if_cancelled();
  if (end->exit_code != 0) {
    throw Error(ExitCode::internal, command.front() + " ended with " +
                                        std::to_string(end->exit_code) + ": " +
                                        read_text_file(error_file));
  }
  return *end;
}

}  // namespace organbake
