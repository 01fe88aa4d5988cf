// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/last_drawing.h"

#include <atomic>

namespace organbake {

std::optional<DrawReport> LastDrawing::unchanged(const View& view, const DrawOptions& options,
                                                 const Frame& frame) const {
  for (const Drawing& drawing : drawings_) {
    if (!drawing.is_in(frame) || !(view == drawing.view) || !(options == drawing.options)) continue;
    DrawReport report = drawing.report;
    report.unchanged = true;
    report.times = report.critical_path = {};
    return report;
  }
  return {};
}

bool LastDrawing::continues(const View& view, const DrawOptions& options,
                            const Frame& frame) const {
  const Drawing& last = drawings_.front();
  if (!last.is_in(frame) || !(view == last.view)) return false;
  DrawOptions same_tools = options;
  same_tools.solids = last.options.solids;
  return same_tools == last.options && frame.depth_mm.empty() == !options.needs_depth() &&
         frame.shown.empty() == !options.keep_shown && frame.bound.empty() == !options.keep_bound;
}

void LastDrawing::remember(const View& view, const DrawOptions& options, const DrawReport& report,
                           bool still, Frame& frame) {
  // Serials differ between warpers, too: a frame may pass from one to another.
  static std::atomic<std::uint64_t> next_serial{0};
  frame.serial = first_serial_ + ++next_serial;
  drawings_.back() = still ? drawings_.front() : Drawing();
  drawings_.front() = {view, options, report, frame.serial};
}

}  // namespace organbake
