// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "organbake/warp/draw_options.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/view.h"

namespace organbake {

// What a warper drew last, to recognise when nothing, or little, has changed since.
class LastDrawing {
 public:
  bool is_in(const Frame& frame) const { return serial_ != 0 && frame.serial == serial_; }
  bool was(const View& view, const DrawOptions& options) const {
    return view == view_ && options == options_;
  }
  // Whether the frame holds it, of the same view, with at most other tools in it.
  bool continues(const View& view, const DrawOptions& options, const Frame& frame) const;
  DrawReport report_unchanged() const;

  // The frame holds this drawing from now on.
  void remember(const View& view, const DrawOptions& options, const DrawReport& report,
                Frame& frame);

 private:
  View view_;
  DrawOptions options_;
  DrawReport report_;
  std::uint64_t serial_ = 0;
};

}  // namespace organbake
