// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// ln albedo of every pixel, of mean 0 over the inside, as far as colour tells it: tissue of another
// colour (gallbladder against liver, fat, blood) is brighter or darker. Shading is continuous where
// colours meet, so that steps of brightness that go with steps of chromaticity are steps of albedo:
// ln albedo is taken for linear in chromaticity, its two slopes by least absolute deviations over
// pairs of pixels a short way apart. Nothing is decided, so that a slightly other picture gives a
// slightly other albedo.
Plane log_albedo_of_color(const Rgb8Image& frame, const Plane& intensity, const Mask& inside);

}  // namespace organbake
