// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "image/channel_image.h"

namespace organbake {

// How likely each pixel shows the organ, by its colour alone, when `inside` holds for each pixel
// how much of it the organ is taken to fill (0…1), or less than 0 where the pixel tells nothing.
// The colours inside and outside are histograms of 16³ cells, blended between cells; both count
// alike, however large they are (Bibby & Reid 2008). 0…1, row by row.
std::vector<float> foreground_probability(const Rgb8Image& photo, const std::vector<float>& inside);

}  // namespace organbake
