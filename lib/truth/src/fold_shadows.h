// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// Darkens skin that lies deeper than what is within some millimetres round it, as folds and the
// gaps between organs are, into which less of the light finds its way. `strength`: 0…1; depth_mm is
// planar, +inf where nothing is, which throws no shadow and gets none.
void darken_folds(double strength, double focal_px, const std::vector<float>& depth_mm,
                  Rgb8Image& picture);

}  // namespace organbake
