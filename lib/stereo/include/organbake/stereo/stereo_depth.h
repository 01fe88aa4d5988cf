// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/frame_depth.h"
#include "organbake/stereo/rectifier.h"

namespace organbake {

struct StereoOptions {
  double nearest_mm = 20, farthest_mm = 400;  // of the tissue from the lens
  // Gaps (highlights, what one eye alone sees) that are no wider than this share of the picture's
  // width are closed, where the surface around them is smooth.
  double reach = 0.02;

  void check() const;  // throws UsageError
};

struct StereoDepth {
  FrameDepth depth;                            // of the left rectified picture, metric
  double matched_share = 0, filled_share = 0;  // of the tissue
  // Of the field of view, whatever the masks hide: that has a depth, matched or filled, of all that
  // is lit enough to match or has one; that is lit enough.
  double covered_share = 0, lit_share = 0;
  double relative_sd = 0;                        // of the depth, median over what is matched
  double rows_apart_px = 0, rows_uneven_px = 0;  // up or down between the eyes, median
};

// Depth of what both eyes see. Confidence is 1 / (1 + (σ / 1 %)²) of the depth's relative standard
// deviation, times how alike the eyes see the place; a quarter of that where a gap was closed.
// Throws BadDataError when the pictures are of unlike size or the right eye's is the left one's.
StereoDepth stereo_depth(const PreparedFrame& left, const PreparedFrame& right,
                         const RectifiedEyes& eyes, const StereoOptions& options);

}  // namespace organbake
