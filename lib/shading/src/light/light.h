// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Red, green and blue in linear light.
using LinearColor = std::array<Plane, 3>;

LinearColor linear_color(const Rgb8Image& frame);

}  // namespace organbake
