// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <string_view>

namespace organbake {

enum class LogLevel { debug, info, warning };

// What a long computation may ask of whoever runs it: a log, a progress bar and "shall I stop?".
// Default-constructed it is silent and never cancels, so library calls and tests need no set-up.
// All members may be called from several threads when the callbacks allow it; the programs' do.
class RunContext {
 public:
  using Log = std::function<void(LogLevel, std::string_view)>;
  using Progress = std::function<void(double fraction_done)>;

  RunContext() = default;
  RunContext(Log log, Progress progress, const std::atomic<bool>* cancel_flag)
      : log_(std::move(log)), progress_(std::move(progress)), cancel_flag_(cancel_flag) {}

  void info(std::string_view message) const { say(LogLevel::info, message); }
  void warn(std::string_view message) const { say(LogLevel::warning, message); }
  void debug(std::string_view message) const { say(LogLevel::debug, message); }
  // fraction_done in 0…1 of the current stage.
  void progress(double fraction_done) const {
    if (progress_) progress_(fraction_done);
  }
  // The same, with someone who hears of every message before the log does.
  [[nodiscard]] RunContext heard_by(Log listener) const;
  [[nodiscard]] bool cancelled() const {
    return cancel_flag_ && cancel_flag_->load(std::memory_order_relaxed);
  }
  // Throws CancelledError; call it between pieces of work of at most about 50 ms.
  void throw_if_cancelled() const;

 private:
  void say(LogLevel level, std::string_view message) const {
    if (log_) log_(level, message);
  }

  Log log_;
  Progress progress_;
  const std::atomic<bool>* cancel_flag_ = nullptr;
};

}  // namespace organbake
