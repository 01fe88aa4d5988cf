// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/image/channel_image.h"

// Errors as pictures, for people who would rather look.
namespace organbake {

// The colour of an error, linear: black at 0, over red and yellow to white where it is the whole
// scale or more; blue where it is not finite.
Eigen::Vector3f heat_color(double share_of_scale);

// One value per pixel, row-major; `scale` is what is drawn white.
Rgb8Image heat_map(const std::vector<double>& values, int width, double scale);

}  // namespace organbake
