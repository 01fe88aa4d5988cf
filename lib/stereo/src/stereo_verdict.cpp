// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/stereo_depth.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/text.h"

namespace organbake {
namespace {

// Chosen: rendered tissue is matched to nine tenths; no real pair has told where trust ends.
constexpr double kLeastMatched = 0.25, kMostlyMatched = 0.6;
constexpr double kRowsApart_px = 1.0, kUnsure = 0.03;
constexpr double kLeastSeen = 0.02;  // of the frame

std::string as_percent(double share) { return to_text(100 * share, 1) + " %"; }

}  // namespace

DepthQuality judge_stereo(const StereoDepth& result, const PreparedFrame& left) {
  const auto& counts = left.counts.values;
  const double seen = 1 - static_cast<double>(std::count(counts.begin(), counts.end(), 0)) /
                              static_cast<double>(std::max<std::size_t>(1, counts.size()));
  DepthQuality quality{DepthVerdict::ok, "", result.matched_share, 0};
  if (seen < kLeastSeen) {
    quality.verdict = DepthVerdict::failed;
    quality.reason = "only " + as_percent(seen) +
                     " of the frame is lit tissue that is neither highlight nor instrument";
  } else if (result.matched_share < kLeastMatched) {
    quality.verdict = DepthVerdict::failed;
    quality.reason = "only " + as_percent(result.matched_share) +
                     " of the tissue is found again by the other eye";
  } else if (std::abs(result.rows_apart_px) > kRowsApart_px) {
    quality.verdict = DepthVerdict::doubtful;
    quality.reason = "the rows of the eyes are " + to_text(result.rows_apart_px, 1) +
                     " px apart: the calibration is not that of these pictures, or they were not "
                     "taken at the same time";
  } else if (result.matched_share < kMostlyMatched) {
    quality.verdict = DepthVerdict::doubtful;
    quality.reason =
        as_percent(result.matched_share) + " of the tissue is found again by the other eye";
  } else if (result.relative_sd > kUnsure) {
    quality.verdict = DepthVerdict::doubtful;
    quality.reason = "the depth is uncertain by " + as_percent(result.relative_sd) + " (median)";
  }
  return quality;
}

}  // namespace organbake
