// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "image/channel_image.h"

namespace organbake {

constexpr int kColorKinds = 5;
// How much of a pixel is of each kind; sums to 1.
using KindShares = std::array<float, kColorKinds>;

// The kinds of colour that a picture consists of, a mixture of Gaussians in CIE Lab, and how much
// of each pixel is of which kind. `factor` × `factor` pixels are one; nothing for a picture with
// too few. Row by row; the same for any number of threads.
std::vector<KindShares> color_kinds(const Rgb8Image& picture, int factor);

}  // namespace organbake
