// SPDX-License-Identifier: GPL-3.0-or-later
#include "terminal.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace organbake {
namespace {

constexpr const char* kRed = "\033[31m";
constexpr const char* kYellow = "\033[33m";
constexpr const char* kPlain = "\033[0m";
constexpr const char* kEraseLine = "\r\033[K";

void put(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }

}  // namespace

Terminal::Terminal() {
  const char* kind = std::getenv("TERM");
  const char* no_color = std::getenv("NO_COLOR");
  is_terminal_ = ::isatty(STDERR_FILENO) && !(kind && std::string_view(kind) == "dumb");
  colors_ = is_terminal_ && !(no_color && *no_color);
}

Terminal::~Terminal() { end_progress(); }

void Terminal::log(LogLevel level, std::string_view message) {
  if (level == LogLevel::debug && verbosity_ != Verbosity::verbose) return;
  if (level == LogLevel::info && verbosity_ == Verbosity::quiet) return;
  if (level == LogLevel::warning) {
    write_line("warning: " + std::string(message), kYellow);
  } else {
    write_line(message, nullptr);
  }
}

void Terminal::error(std::string_view message) {
  write_line("organbake: error: " + std::string(message), kRed);
}

void Terminal::progress(const std::string& what, double fraction_done) {
  if (!is_terminal_ || verbosity_ == Verbosity::quiet) return;
  const int percent = static_cast<int>(100 * std::clamp(fraction_done, 0.0, 1.0));
  const std::lock_guard lock(mutex_);
  if (percent == shown_percent_) return;
  shown_percent_ = percent;
  constexpr int kCells = 30;
  const int filled = percent * kCells / 100;
  put(kEraseLine + what + " [" + std::string(filled, '#') + std::string(kCells - filled, ' ') +
      "] " + std::to_string(percent) + " %");
  std::fflush(stderr);
}

void Terminal::end_progress() {
  const std::lock_guard lock(mutex_);
  erase_bar();
}

void Terminal::write_line(std::string_view line, const char* color) {
  const std::lock_guard lock(mutex_);
  erase_bar();
  const bool colored = color && colors_;
  put((colored ? color : "") + std::string(line) + (colored ? kPlain : "") + "\n");
}

void Terminal::erase_bar() {
  if (shown_percent_ < 0) return;
  put(kEraseLine);
  shown_percent_ = -1;
}

}  // namespace organbake
