// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

// Mirror reflections of the light on moist tissue: pixels that are saturated, or clearly brighter
// and whiter than what lies round them (a window of about a tenth of the frame), with the rim that
// coding and blooming leave. Non-zero = highlight.
Mask find_highlights(const Rgb8Image& frame, const Mask& inside);

}  // namespace organbake
