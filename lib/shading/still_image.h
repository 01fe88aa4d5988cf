// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "shading/log_range_fit.h"

namespace organbake {

// An image so coarse that most of its noise is gone, to hold a following frame against.
struct CoarseImage {
  Plane intensity, variance;
  Mask inside;
};

// `levels`: each half the size of the one before it.
CoarseImage coarse_image(const std::vector<ShadedImage>& levels);

// Whether noise alone tells the two apart: nothing moved that these pixels could show, be it the
// whole scene by a little or one spot by more.
bool shows_the_same(const CoarseImage& before, const CoarseImage& now);

}  // namespace organbake
