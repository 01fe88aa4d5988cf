// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "disparity.h"

namespace organbake {

// Puts the plane through its surroundings into every place of `tissue` that lies in a gap narrower
// than `width_px` between known ones, where the surroundings lie on one plane. Returns what was
// filled; elsewhere px stays a guess. A wider width fills the same and more.
Mask close_gaps(const Mask& tissue, double width_px, Disparity& disparity);

}  // namespace organbake
