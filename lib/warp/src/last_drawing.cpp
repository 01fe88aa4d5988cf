// SPDX-License-Identifier: Apache-2.0
#include "last_drawing.h"

#include <atomic>

namespace organbake {

bool LastDrawing::continues(const View& view, const DrawOptions& options,
                            const Frame& frame) const {
  if (!is_in(frame) || !(view == view_)) return false;
  DrawOptions same_tools = options;
  same_tools.solids = options_.solids;
  return same_tools == options_ && frame.depth_mm.empty() == !options.needs_depth() &&
         frame.shown.empty() == !options.keep_shown && frame.bound.empty() == !options.keep_bound;
}

DrawReport LastDrawing::report_unchanged() const {
  DrawReport report = report_;
  report.unchanged = true;
  report.times = report.critical_path = {};
  return report;
}

void LastDrawing::remember(const View& view, const DrawOptions& options, const DrawReport& report,
                           Frame& frame) {
  view_ = view, options_ = options, report_ = report;
  // Serials differ between warpers, too: a frame may pass from one to another.
  static std::atomic<std::uint64_t> next_serial{0};
  frame.serial = serial_ = ++next_serial;
}

}  // namespace organbake
