// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

struct ImageDifference {
  double psnr_db = 0;      // over the counted pixels; +inf when equal
  double mean_abs = 0;     // 0…255
  double max_abs = 0;      // 0…255
  std::size_t pixels = 0;  // counted
};

// Differences of 8-bit sRGB values over all pixels, or where mask is non-zero (one byte a pixel,
// empty = all). Throws BadDataError when sizes differ.
ImageDifference compare_images(const Rgb8Image& a, const Rgb8Image& b,
                               const std::vector<std::uint8_t>& mask = {});

// Mean structural similarity of the luma planes (Wang et al. 2004: 11×11 Gaussian, σ = 1.5,
// K1 = 0.01, K2 = 0.03) over the same pixels.
double structural_similarity(const Rgb8Image& a, const Rgb8Image& b,
                             const std::vector<std::uint8_t>& mask = {});

}  // namespace organbake
