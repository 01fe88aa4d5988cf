// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace organbake {

// One channel of a picture, row by row, under three boxes of 2 · radius + 1 pixels, each sum kept
// running: near enough to a Gaussian of about the radius. Beyond the border is what lies there.
std::vector<float> box_blurred(std::vector<float> channel, int width, int height, int radius);

}  // namespace organbake
