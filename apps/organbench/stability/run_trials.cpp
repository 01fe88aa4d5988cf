// SPDX-License-Identifier: GPL-3.0-or-later
#include <poll.h>
#include <signal.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>

#include "child_process.h"
#include "organbake/core/error.h"
#include "stability/trial.h"

namespace organbake {
namespace {

using Json = nlohmann::json;

struct Seeds {
  std::uint64_t next, end;
};

std::string line_of(const Trial& trial) {
  const Json json = {
      {"seed", trial.seed},   {"stage", trial.stage},   {"outcome", int(trial.outcome)},
      {"error", trial.error}, {"cpu_ms", trial.cpu_ms}, {"message", trial.message}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Trial trial_from(const std::string& line) {
  const Json json = Json::parse(line);
  return {json.at("seed"),  json.at("stage"),  Outcome(json.at("outcome").get<int>()),
          json.at("error"), json.at("cpu_ms"), json.at("message")};
}

void work(const Trials& trials, Seeds seeds, int fd) {
  const auto folder = trials.folder / std::to_string(::getpid());
  std::filesystem::create_directories(folder);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  ::signal(SIGALRM, SIG_DFL);
  ::signal(SIGPROF, SIG_DFL);
  for (; seeds.next < seeds.end; ++seeds.next) {
    const itimerval most_cpu = {{0, 0}, {time_t(trials.most_seconds), 0}};
    ::setitimer(ITIMER_PROF, &most_cpu, nullptr);
    ::alarm(trials.patience * trials.most_seconds);
    if (!write_line(fd, line_of(run_trial(seeds.next, folder, trials.probes)))) break;
  }
}

class Pool {
 public:
  Pool(const Trials& trials, const RunContext& context,
       const std::function<void(std::size_t)>& done)
      : trials_(trials), context_(context), done_(done) {
    constexpr std::uint64_t kChunk = 32;
    const std::uint64_t end = trials.first_seed + trials.count;
    for (std::uint64_t seed = trials.first_seed; seed < end; seed += kChunk) {
      waiting_.push_back({seed, std::min(seed + kChunk, end)});
    }
  }
  ~Pool() {
    for (const Worker& worker : workers_) end_child(worker.child, SIGKILL);
  }
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  std::vector<Trial> run() {
    while (!waiting_.empty() || !workers_.empty()) {
      context_.throw_if_cancelled();
      while (!waiting_.empty() && workers_.size() < std::size_t(trials_.jobs)) start();
      listen();
    }
    std::sort(found_.begin(), found_.end(),
              [](const Trial& a, const Trial& b) { return a.seed < b.seed; });
    return std::move(found_);
  }

 private:
  struct Worker {
    ChildProcess child;
    Seeds seeds;         // `next` has not been heard of yet
    std::string unread;  // of a line
  };

  void start() {
    const Seeds seeds = waiting_.front();
    waiting_.pop_front();
    workers_.push_back({start_child([&](int fd) { work(trials_, seeds, fd); }), seeds, {}});
  }

  void listen() {
    std::vector<pollfd> ends;
    for (const Worker& worker : workers_) ends.push_back({worker.child.fd, POLLIN, 0});
    constexpr int kWait_ms = 100;  // till Ctrl-C is looked at
    if (::poll(ends.data(), ends.size(), kWait_ms) <= 0) return;
    for (std::size_t i = ends.size(); i-- > 0;) {
      if (ends[i].revents && !hear(workers_[i])) {
        bury(workers_[i]);
        workers_.erase(workers_.begin() + std::ptrdiff_t(i));
      }
    }
  }

  bool hear(Worker& worker) {
    char buffer[1 << 14];
    const ssize_t n = ::read(worker.child.fd, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) return true;
    if (n <= 0) return false;
    worker.unread.append(buffer, std::size_t(n));
    for (std::size_t end; (end = worker.unread.find('\n')) != std::string::npos;) {
      found_.push_back(trial_from(worker.unread.substr(0, end)));
      worker.unread.erase(0, end + 1);
      worker.seeds.next = found_.back().seed + 1;
    }
    done_(found_.size());
    return true;
  }

  // What a worker left undone: the trial that ended it, and those behind that one.
  void bury(const Worker& worker) {
    const int status = end_child(worker.child);
    Seeds rest = worker.seeds;
    if (rest.next == rest.end) return;
    const int by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    const bool late = by == SIGPROF || by == SIGALRM;
    const std::string how =
        by != 0 ? ::strsignal(by) : "exit code " + std::to_string(WEXITSTATUS(status));
    const char* stage = trials_.probes[rest.next % trials_.probes.size()].stage;
    found_.push_back({rest.next, stage, late ? Outcome::hung : Outcome::crashed, 0, 0, how});
    if (++rest.next < rest.end) waiting_.push_front(rest);
  }

  const Trials& trials_;
  const RunContext& context_;
  const std::function<void(std::size_t)>& done_;
  std::deque<Seeds> waiting_;
  std::vector<Worker> workers_;
  std::vector<Trial> found_;
};

}  // namespace

std::vector<Trial> run_trials(const Trials& trials, const RunContext& context,
                              const std::function<void(std::size_t)>& done) {
  return Pool(trials, context, done).run();
}

}  // namespace organbake
