// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/shading/laparoscope.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/shading/relief_share.h"

namespace organbake {

enum class DepthVerdict { ok, doubtful, failed };
const char* name_of(DepthVerdict verdict);

// Whether a frame supports the shape that was read from it.
struct DepthQuality {
  DepthVerdict verdict = DepthVerdict::failed;
  std::string reason;  // empty when ok
  double support = 0;  // 0…1: the share of the relief's variance, or of the view, that is kept
  double unexplained = 0;  // share of the brightness, at organ scale, that no shape explains
  ReliefShare kept = {};   // of a shaded frame's relief
};

// A small misfit proves no shape, but a large one disproves the model: brightness that no smooth
// surface explains is texture, several tissues or another light, and then the rest, which one does
// explain, is as likely the same. What is kept of the relief is relief_share() of the frame, evened
// with what was kept of `previous`, the frame before it where that looks alike (else null): shares
// follow a clip without flicker, and a depth that was taken over keeps its own.
[[nodiscard]] DepthQuality judge_depth(const PreparedFrame& frame, const RangeEstimate& estimate,
                                       const DepthQuality* previous = nullptr);

}  // namespace organbake
