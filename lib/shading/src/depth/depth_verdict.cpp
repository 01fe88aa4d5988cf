// SPDX-License-Identifier: GPL-3.0-or-later
// A verdict on a depth map by what no smooth surface explains of the picture at the scale of
// organs. The bounds come from rendered tissue with known depth and from real frames; where each
// was measured stands beside them.
#include "organbake/shading/depth_verdict.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/core/text.h"

namespace organbake {
namespace {

// Of the brightness that stays unexplained. Rendered tissue leaves 0.018 at most with a tenth of
// texture, its depth within 1 %; real frames, whose depth is not ok, 0.06 to 0.21.
constexpr double kMostUnexplained = 0.03;
constexpr double kLeastSeen = 0.02;  // of the frame, to tell a shape from

double share(const Mask& mask) {
  const auto zeros = std::count(mask.values.begin(), mask.values.end(), 0);
  return 1 -
         static_cast<double>(zeros) / static_cast<double>(std::max<std::size_t>(1, mask.size()));
}

// Even with what was kept of the frame before.
void keep_what_is_safe(const ReliefEvidence& evidence, const DepthQuality* previous,
                       DepthQuality& quality) {
  quality.kept = relief_share(evidence);
  quality.support =
      evidence.tilt_share * quality.kept.tilt + (1 - evidence.tilt_share) * quality.kept.rest;
  if (!previous) return;
  for (const auto part : {&ReliefShare::tilt, &ReliefShare::rest})
    quality.kept.*part = 0.5 * (quality.kept.*part + previous->kept.*part);
  quality.support = 0.5 * (quality.support + previous->support);
}

}  // namespace

const char* name_of(DepthVerdict verdict) {
  switch (verdict) {
    case DepthVerdict::ok:
      return "ok";
    case DepthVerdict::doubtful:
      return "doubtful";
    case DepthVerdict::failed:
      break;
  }
  return "failed";
}

DepthQuality judge_depth(const PreparedFrame& frame, const RangeEstimate& estimate,
                         const DepthQuality* previous) {
  DepthQuality quality;
  const double seen = share(frame.diffuse);
  if (!estimate.usable || seen < kLeastSeen) {
    quality.reason = "only " + percent(seen, 1) +
                     " of the frame is lit tissue that is neither highlight nor instrument";
    return quality;
  }
  quality.unexplained = estimate.unexplained;
  const bool taken_over = estimate.warm && estimate.refinements == 0;
  if (previous && taken_over) {
    quality.support = previous->support;
    quality.kept = previous->kept;
  } else {
    keep_what_is_safe(relief_evidence(frame, estimate), previous, quality);
  }
  quality.verdict =
      estimate.unexplained <= kMostUnexplained ? DepthVerdict::ok : DepthVerdict::doubtful;
  if (frame.stereo != StereoLayout::none) {
    quality.verdict = DepthVerdict::doubtful;
    quality.reason = "the frame holds two like pictures, as of a stereo endoscope";
  } else if (quality.verdict == DepthVerdict::doubtful) {
    quality.reason = percent(estimate.unexplained, 1) +
                     " of the brightness is explained by no smooth shape under a lamp at the lens "
                     "(more than " +
                     percent(kMostUnexplained, 1) +
                     "): texture, several tissues or another light explain the picture as well";
  }
  return quality;
}

}  // namespace organbake
