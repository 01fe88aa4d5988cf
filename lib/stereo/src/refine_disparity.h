// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "disparity.h"

namespace organbake {

// How well the eyes agree about each pixel, over the window that was fitted.
struct Agreement {
  Plane correlation;  // −1…1, of the two patterns
  Plane sd_px;        // of the disparity, by what is left between the patterns and their contrast
  // Median of how far up or down the patterns would have to move to fit better, px: about 0 when
  // the calibration is that of these pictures.
  double rows_apart_px = 0;
  // The same by parts of the picture, as most parts have it: a lens that is not the calibration's
  // moves them each another way.
  double rows_uneven_px = 0;
};

struct MatchWindow {
  int radius_px = 3;   // of the window, which is weighted like a tent
  int iterations = 3;  // Gauss–Newton steps
};

// Moves each disparity so that the right pattern lies on the left one, by least squares over the
// window (Lucas & Kanade 1981) along the row alone. Where nothing counts it stays.
void refine_disparity(const EyeImage& left, const EyeImage& right, const MatchWindow& options,
                      Disparity& disparity);

// Of disparities as they are.
Agreement judge_disparity(const EyeImage& left, const EyeImage& right, const MatchWindow& options,
                          const Disparity& disparity);

// What is known and leaves the plane of its surroundings by far is no longer known.
void drop_strangers(Disparity& disparity);

// Averages what is known over planes as wide as its noise asks for.
void smooth_disparity(const Plane& sd_px, Disparity& disparity);

}  // namespace organbake
