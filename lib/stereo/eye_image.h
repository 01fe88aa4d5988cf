// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

// What one eye sees, as it is matched.
struct EyeImage {
  // Brightness against its surroundings, in standard deviations of them: the lamp's fall-off and
  // the eyes' unlike gains are gone. 0 where nothing counts.
  Plane pattern;
  Mask counts;  // tissue that is neither highlight nor instrument
};

// The eye at full size and halved, until no side is longer than `longest_px`; the finest first.
std::vector<EyeImage> eye_pyramid(const Rgb8Image& color, const Mask& counts, int longest_px);

}  // namespace organbake
