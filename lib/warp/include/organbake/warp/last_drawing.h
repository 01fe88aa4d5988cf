// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "organbake/warp/draw_options.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/view.h"

namespace organbake {

// What was drawn last, to recognise when nothing, or little, has changed since: one drawing, or, of
// organs that two eyes look at turn about, both eyes'.
class LastDrawing {
 public:
  // first_serial: of frames, for whoever draws beside another program's part that counts from 0.
  explicit LastDrawing(std::uint64_t first_serial = 0) : first_serial_(first_serial) {}

  // The report on the drawing of this view that the frame holds, the organs lying as in the last.
  std::optional<DrawReport> unchanged(const View& view, const DrawOptions& options,
                                      const Frame& frame) const;
  // Whether the frame holds the last one, of the same view, with at most other tools in it.
  bool continues(const View& view, const DrawOptions& options, const Frame& frame) const;

  // The frame holds this drawing from now on; still: organs lie as in the one before.
  void remember(const View& view, const DrawOptions& options, const DrawReport& report, bool still,
                Frame& frame);

 private:
  struct Drawing {
    View view;
    DrawOptions options;
    DrawReport report;
    std::uint64_t serial = 0;

    bool is_in(const Frame& frame) const { return serial != 0 && frame.serial == serial; }
  };
  std::uint64_t first_serial_;
  std::array<Drawing, 2> drawings_;  // the last one first
};

}  // namespace organbake
