// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "organbake/core/parallel.h"

namespace organbake {

// Adds the work since the last lap to a phase, and its longest chain to another, when asked to
// measure at all.
class PhaseClock {
 public:
  explicit PhaseClock(bool measure) {
    if (measure) meter_.emplace();
  }
  WorkSpan lap() { return meter_ ? meter_->lap() : WorkSpan(); }
  void lap(double& work_ms) { work_ms += lap().work_ms; }
  void lap(double& work_ms, double& span_ms) {
    const WorkSpan since = lap();
    work_ms += since.work_ms;
    span_ms += since.span_ms;
  }

 private:
  std::optional<WorkMeter> meter_;
};

}  // namespace organbake
