// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

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

}  // namespace organbake
