// SPDX-License-Identifier: Apache-2.0
// The transfer curve of sRGB (IEC 61966-2-1). Pictures take its 8-bit form for every pixel, so that
// one comes from tables that give what the formula gives, to the bit.
#include "organbake/image/srgb.h"

#include <algorithm>
#include <cmath>

namespace organbake {

float srgb_from_linear(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

float linear_from_srgb(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

namespace {

// The 8-bit level by the formula itself, from which the table of its steps is made.
std::uint8_t formula8(float linear) {
  return static_cast<std::uint8_t>(255 * srgb_from_linear(linear) + 0.5f);
}

// In a bin of linear light at most one 8-bit level begins, since the curve rises by at most 3,295
// levels a unit: its first level and where the next begins say what the formula says, to the bit.
class SrgbLevels {
 public:
  SrgbLevels() {
    for (int level = 1; level < 256; ++level) begins_[level - 1] = first_of(level);
    for (int bin = 0; bin <= kBins; ++bin) first_[bin] = formula8(static_cast<float>(bin) / kBins);
    begins_[255] = 2;
  }
  std::uint8_t of(float linear) const {
    const std::uint8_t level = first_[static_cast<int>(linear * kBins)];
    return static_cast<std::uint8_t>(level + (linear >= begins_[level]));
  }

 private:
  static constexpr int kBins = 4096;

  // The least light of that level: positive numbers lie in the order of their bits.
  static float first_of(int level) {
    std::uint32_t below = 0, from = __builtin_bit_cast(std::uint32_t, 1.0f);
    while (from - below > 1) {
      const std::uint32_t middle = below + (from - below) / 2;
      (formula8(__builtin_bit_cast(float, middle)) >= level ? from : below) = middle;
    }
    return __builtin_bit_cast(float, from);
  }

  std::array<float, 256> begins_{};  // of the level after
  std::array<std::uint8_t, kBins + 1> first_{};
};

}  // namespace

std::uint8_t srgb8_from_linear(float linear) {
  static const SrgbLevels levels;
  // The comparison also sends NaN to black.
  return levels.of(linear > 0 ? std::min(linear, 1.0f) : 0.0f);
}

const std::array<float, 256>& linear_from_srgb8() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> values{};
    for (int i = 0; i < 256; ++i) values[i] = linear_from_srgb(static_cast<float>(i) / 255);
    return values;
  }();
  return table;
}

}  // namespace organbake
