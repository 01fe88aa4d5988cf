// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace organbake {

// IEC 61966-2-1. linear and encoded in 0…1; values outside are clamped by the 8-bit forms.
float srgb_from_linear(float linear);
float linear_from_srgb(float encoded);
std::uint8_t srgb8_from_linear(float linear);       // rounds to nearest
const std::array<float, 256>& linear_from_srgb8();  // the table, built once

// Of linear light, by ITU-R BT.709's primaries, which are sRGB's.
constexpr float luminance(float red, float green, float blue) {
  return 0.2126f * red + 0.7152f * green + 0.0722f * blue;
}

}  // namespace organbake
