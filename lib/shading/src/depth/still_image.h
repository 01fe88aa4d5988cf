// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/shading/laparoscope.h"
#include "organbake/shading/log_range_fit.h"

namespace organbake {

// `levels`: each half the size of the one before it.
CoarseImage coarse_image(const std::vector<ShadedImage>& levels);

// Whether noise alone tells the two apart: nothing moved that these pixels could show, be it the
// whole scene by a little or one spot by more.
bool shows_the_same(const CoarseImage& before, const CoarseImage& now);

}  // namespace organbake
