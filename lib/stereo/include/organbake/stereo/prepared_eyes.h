// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/prepared_frame.h"
#include "organbake/stereo/rectifier.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {

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

// Both pictures rectified, on the same rows, with their masks, ready to be matched. Rows that are
// apart are seen from features of both pictures and corrected, where they are apart by more than
// chance. What the masks take for an instrument stays tissue where both eyes see it on the surface
// around it. `masks` = false: all is tissue.
PreparedEyes prepare_eyes(StoredPicture left, StoredPicture right, const Rectifier& rectifier,
                          const StereoOptions& options, bool masks = true);

}  // namespace organbake
