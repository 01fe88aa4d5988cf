// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Depth of what both eyes of an endoscope see.

#include "organbake/shading/frame_depth.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/stereo/stereo_rig.h"

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
  // Of what is found in both eyes, where that is less than half of what is lit: how much chance
  // would find in a picture of something else; and how much of what is found at any distance lies
  // at others than those that were asked for.
  double chance_share = 0, elsewhere_share = 0;
  double relative_sd = 0;  // of the depth, median over what is matched
  // Of pictures that are made of squares, which match square by square: how far, as a share of the
  // depth, one step of it is from the next, median; else 0.
  double step_share = 0;
  double rows_apart_px = 0, rows_uneven_px = 0;  // up or down between the eyes, median
};

// Depth of what both eyes see. Confidence is 1 / (1 + (σ / 1 %)²) of the depth's relative standard
// deviation, times how alike the eyes see the place; a quarter of that where a gap was closed.
// Throws BadDataError when the pictures are of unlike size or the right eye's is the left one's.
StereoDepth stereo_depth(const PreparedFrame& left, const PreparedFrame& right,
                         const RectifiedEyes& eyes, const StereoOptions& options);

// How the right picture stands to the left one where the calibration says that it does not: what a
// bumped scope, a stretched video or a calibration of another day leaves.
struct RowAlignment {
  double shift_px = 0;  // how far below the left one's its rows lie at the right principal point
  double roll_rad = 0;  // of the right picture about that point, clockwise as seen

  bool needed() const { return shift_px != 0 || roll_rad != 0; }
};

struct PreparedEyes {
  PreparedFrame left, right;
  RowAlignment corrected;  // what was taken out of the right picture
};

// What a recorder has laid over either eye's pictures (InsetFinder), as they come; of no size where
// there is nothing.
struct EyeInsets {
  Mask left, right;
};

// Both pictures rectified, on the same rows, with their masks, ready to be matched. Rows that are
// apart are seen from features of both pictures and corrected, where they are apart by more than
// chance. What the masks take for an instrument stays tissue where both eyes see it on the surface
// around it. `masks` = false: all is tissue.
PreparedEyes prepare_eyes(StoredPicture left, StoredPicture right, const Rectifier& rectifier,
                          const StereoOptions& options, bool masks = true,
                          const EyeInsets& insets = {});

}  // namespace organbake
