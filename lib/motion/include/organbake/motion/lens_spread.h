// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/bundle_adjustment.h"

namespace organbake {

// How sure a lens is that a clip told of itself: standard deviations; 0 of what was given.
struct LensSpread {
  double focal_px = 0, k1 = 0, center_x_px = 0, center_y_px = 0;
};

// By leaving out one part of the clip after another (block jackknife, Künsch 1989): what tracks
// have wrong hangs together over time, so that the equations' own covariance would be far too sure.
LensSpread lens_spread(const FreeLens& free, const Scene& scene);

}  // namespace organbake
