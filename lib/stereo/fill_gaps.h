// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "stereo/disparity.h"

namespace organbake {

// What is known and leaves the plane of its surroundings by far is no longer known.
void drop_strangers(Disparity& disparity);

// Averages what is known over planes as wide as its noise asks for, and puts the plane through its
// surroundings into the gaps of `tissue` that have surroundings on most sides, within `reach` of
// the picture's width, that lie on one plane. Returns the gaps that were filled; elsewhere px is a
// guess still.
Mask smooth_and_fill(const Plane& sd_px, const Mask& tissue, double reach, Disparity& disparity);

}  // namespace organbake
