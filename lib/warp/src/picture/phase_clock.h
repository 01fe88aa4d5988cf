// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace organbake {

// Adds what has passed since the last lap to a phase, when asked to measure at all.
class PhaseClock {
 public:
  explicit PhaseClock(bool measure) : measure_(measure) { restart(); }
  void restart() {
    if (measure_) start_ = Clock::now();
  }
  void lap(double& phase_ms) {
    if (!measure_) return;
    const Clock::time_point now = Clock::now();
    phase_ms += std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool measure_;
  Clock::time_point start_;
};

}  // namespace organbake
