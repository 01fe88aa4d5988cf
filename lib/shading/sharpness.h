// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/channel_image.h"

namespace organbake {

// Mean squared Laplacian of the green channel: falls when a frame is blurred by motion.
double sharpness(const Rgb8Image& frame);
// Mean absolute difference of two frames' green channels (0…255); infinite when sizes differ.
double mean_difference(const Rgb8Image& a, const Rgb8Image& b);

}  // namespace organbake
