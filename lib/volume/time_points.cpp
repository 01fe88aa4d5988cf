// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/time_points.h"

#include "core/error.h"

namespace organbake {

std::int64_t chosen_time(const TimePoints& times, const VolumeReadOptions& options,
                         const std::string& name) {
  if (times.count < 1) {
    throw BadDataError(name + ": holds " + std::to_string(times.count) + " time points");
  }
  if (times.count == 1 && options.is_mask) return 0;  // it lies on every time point of its CT
  if (options.time > times.count) {
    throw UsageError(name + ": holds " + std::to_string(times.count) +
                     (times.count == 1 ? " time point" : " time points") + ", no --time " +
                     std::to_string(options.time));
  }
  if (options.time > 0) return options.time - 1;
  if (times.count == 1 || options.any_time) return 0;
  throw BadDataError(name + ": holds " + std::to_string(times.count) + " time points" +
                     (times.step.empty() ? "" : ", " + times.step) + "; choose one with --time 1…" +
                     std::to_string(times.count));
}

}  // namespace organbake
