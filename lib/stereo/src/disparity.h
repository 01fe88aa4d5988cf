// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Disparities: found, refined, judged, and their gaps closed.

#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {

// What one eye sees, as it is matched.
struct EyeImage {
  // Brightness against its surroundings, in standard deviations of them: the lamp's fall-off and
  // the eyes' unlike gains are gone. 0 where nothing counts.
  Plane pattern;
  Mask diffuse;  // tissue that is neither highlight nor instrument
};

// The eye at full size and halved, until no side is longer than `longest_px`; the finest first.
std::vector<EyeImage> eye_pyramid(const Rgb8Image& color, const Mask& counts, int longest_px);

// How far to the left the right eye sees what the left eye sees in a pixel.
struct Disparity {
  Plane px;
  Mask known;  // elsewhere px is a guess
};

struct DisparityRange {
  double least_px = 0, most_px = 64;
};
// Of tissue from the nearest to the farthest that is asked for; `scale` is that of the pictures.
DisparityRange disparity_range(const RectifiedEyes& eyes, const StereoOptions& options,
                               double scale = 1);

// Semi-global matching (Hirschmüller 2008; OpenCV's) of whole pixels and their halves, both ways;
// known is what either eye finds alike.
Disparity match_eyes(const EyeImage& left, const EyeImage& right, const DisparityRange& range);

// Of a level of half the size; guesses go along.
Disparity doubled(const Disparity& half, int width, int height);

// Guesses for what is not known: planes through what is known around, the nearer the more.
void guess_unknown(const Mask& wanted, Disparity& disparity);

// Whether the pictures of two eyes match far better when they change places than as they are. Looks
// only when they match badly as they are (`matched_share` of the tissue).
bool swapped(const EyeImage& left, const EyeImage& right, const DisparityRange& range,
             double matched_share);

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

// Averages what is known over planes as wide as its noise allows, up to some thirty pixels; steps
// stay where they are.
void smooth_disparity(const Plane& sd_px, Disparity& disparity);

// Puts the plane through its surroundings into every place of `tissue` that lies in a gap narrower
// than `width_px` between known ones, where the surroundings lie on one plane. Returns what was
// filled; elsewhere px stays a guess. A wider width fills the same and more.
Mask close_gaps(const Mask& tissue, double width_px, Disparity& disparity);

}  // namespace organbake
