// SPDX-License-Identifier: Apache-2.0
#include "terminal.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace organbake {
namespace {

using namespace std::chrono_literals;

constexpr const char* kRed = "\033[31m";
constexpr const char* kYellow = "\033[33m";
constexpr const char* kPlain = "\033[0m";
constexpr const char* kEraseLine = "\r\033[K";
constexpr double kSoon_s = 2;  // what takes less needs no word

void put(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }

double seconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

std::string duration_text(double time_s) {
  constexpr int kMinute_s = 60;
  const int whole = static_cast<int>(std::lround(time_s));
  if (whole < 2 * kMinute_s) return std::to_string(whole) + " s";
  return std::to_string((whole + kMinute_s / 2) / kMinute_s) + " min";
}

}  // namespace

Terminal::Terminal(std::string program) : program_(std::move(program)) {
  const char* kind = std::getenv("TERM");
  is_terminal_ = ::isatty(STDERR_FILENO) && !(kind && std::string_view(kind) == "dumb");
  obey(flags_);
}

Terminal::~Terminal() { end_progress(); }

void Terminal::obey(const SharedFlags& flags) {
  flags_ = flags;
  const char* no_color = std::getenv("NO_COLOR");
  const bool unwanted = no_color && *no_color;
  colors_ = flags.color == "always" || (flags.color == "auto" && is_terminal_ && !unwanted);
}

void Terminal::log(LogLevel level, std::string_view message) {
  if (level == LogLevel::debug && !flags_.verbose) return;
  if (level == LogLevel::info && flags_.quiet && !flags_.verbose) return;
  if (level == LogLevel::warning) {
    write_line("warning: " + std::string(message), kYellow);
  } else {
    write_line(message, nullptr);
  }
}

void Terminal::error(std::string_view message) {
  end_progress();
  write_line(program_ + ": error: " + std::string(message), kRed);
}

void Terminal::progress(const std::string& task, double fraction_done) {
  if (!is_terminal_ || flags_.quiet) return;
  if (fraction_done >= 1) return end_progress();
  const std::lock_guard lock(mutex_);
  told_ = Clock::now();
  fraction_ = std::max(fraction_done, 0.0);
  if (task != task_ || fraction_ == 0) {
    task_ = task;
    begun_ = told_;
    first_fraction_ = fraction_;
  }
  if (!drawing_.joinable())
    drawing_ = std::jthread([this](const std::stop_token& stop) { keep_drawing(stop); });
  draw();
}

void Terminal::end_progress() {
  const std::lock_guard lock(mutex_);
  task_.clear();
  erase();
}

RunContext Terminal::context(const std::string& task, const std::atomic<bool>* stop_asked) {
  return {[this, task](LogLevel level, std::string_view message) {
            log(level, task + ": " + std::string(message));
          },
          [this, task](double fraction) { progress(task, fraction); }, stop_asked};
}

void Terminal::write_line(std::string_view line, const char* color) {
  const std::lock_guard lock(mutex_);
  erase();
  const bool colored = color && colors_;
  put((colored ? color : "") + std::string(line) + (colored ? kPlain : "") + "\n");
}

// Tasks need not say anything while they work: the time goes on by itself.
void Terminal::keep_drawing(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, stop, 500ms, [] { return false; }) && !stop.stop_requested())
    draw();
}

std::string Terminal::progress_line() const {
  const Clock::time_point now = Clock::now();
  const double passed_s = seconds(now - begun_);
  if (fraction_ <= 0)
    return passed_s < kSoon_s ? std::string() : task_ + ": " + duration_text(passed_s);
  constexpr int kCells = 30;
  const int percent = static_cast<int>(100 * fraction_), filled = percent * kCells / 100;
  std::string line = task_ + " [" + std::string(filled, '#') + std::string(kCells - filled, ' ') +
                     "] " + std::to_string(percent) + " %";
  if (passed_s < kSoon_s) return line;
  // As if the rest went on at the pace until now.
  const double done = fraction_ - first_fraction_;
  const double left_s = seconds(told_ - begun_) * (1 - first_fraction_) / done - passed_s;
  return line + (left_s >= 1 && done > 0 ? ", about " + duration_text(left_s) + " left"
                                         : ", " + duration_text(passed_s));
}

void Terminal::draw() {
  if (task_.empty()) return;
  const std::string line = progress_line();
  if (line == shown_) return;
  put(kEraseLine + line);
  std::fflush(stderr);
  shown_ = line;
}

void Terminal::erase() {
  if (shown_.empty()) return;
  put(kEraseLine);
  shown_.clear();
}

}  // namespace organbake
