// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <mutex>
#include <string>
#include <string_view>

#include "organbake/core/run_context.h"

namespace organbake {

enum class Verbosity { quiet, normal, verbose };

// All that a program says besides its result goes here, to stderr: plain lines, and on a terminal a
// progress bar below them. Colours only on a terminal and without NO_COLOR. Thread-safe.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void set_verbosity(Verbosity verbosity) { verbosity_ = verbosity; }
  void log(LogLevel level, std::string_view message);
  void error(std::string_view message);
  void progress(const std::string& what, double fraction_done);
  void end_progress();

 private:
  void write_line(std::string_view line, const char* color);
  void erase_bar();

  std::mutex mutex_;
  Verbosity verbosity_ = Verbosity::normal;
  bool is_terminal_ = false;
  bool colors_ = false;
  int shown_percent_ = -1;  // −1: no bar on the screen
};

}  // namespace organbake
