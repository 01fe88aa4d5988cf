// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// What features are tracked in: the frame's green channel, its contrast evened out (CLAHE). Green
// has the contrast of tissue: blood takes the blue, and red is near saturation.
Grid<std::uint8_t> tracked_picture(const Rgb8Image& frame);

}  // namespace organbake
