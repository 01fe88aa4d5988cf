// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "command_line.h"
#include "organbake/core/run_context.h"

namespace organbake {

// All that a program says besides its result goes here, to stderr: plain lines, and on a terminal
// how far the present task is, below them. Colours only on a terminal and without NO_COLOR.
// Thread-safe.
class Terminal {
 public:
  explicit Terminal(std::string program);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  // What is said from now on, and whether in colours.
  void obey(const SharedFlags& flags);

  void log(LogLevel level, std::string_view message);
  void error(std::string_view message);
  // A task's fraction that is done: 0 begins it, 1 ends it. From its second second on a task that
  // tells no fraction shows how long it has taken; one that does shows a bar and the time left.
  void progress(const std::string& task, double fraction_done);
  void end_progress();

  // A task's messages begin with its name; its progress is shown. The terminal must outlive it.
  RunContext context(const std::string& task, const std::atomic<bool>* stop_asked);

 private:
  using Clock = std::chrono::steady_clock;

  void write_line(std::string_view line, const char* color);
  void keep_drawing(const std::stop_token& stop);
  // Those below want the lock.
  std::string progress_line() const;
  void draw();
  void erase();

  const std::string program_;
  SharedFlags flags_;
  bool is_terminal_ = false;
  bool colors_ = false;

  std::mutex mutex_;
  std::string task_;                          // the present one; empty: none
  double first_fraction_ = 0, fraction_ = 0;  // as it told them
  Clock::time_point begun_, told_;            // and when
  std::string shown_;                         // what stands on the screen's last line
  std::condition_variable_any ended_;
  std::jthread drawing_;  // once there was a task
};

}  // namespace organbake
