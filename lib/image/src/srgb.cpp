// SPDX-License-Identifier: Apache-2.0
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

std::uint8_t srgb8_from_linear(float linear) {
  // The comparison also sends NaN to black.
  const float clamped = linear > 0 ? std::min(linear, 1.0f) : 0.0f;
  return static_cast<std::uint8_t>(255 * srgb_from_linear(clamped) + 0.5f);
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
