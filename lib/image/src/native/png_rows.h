// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace organbake {

// Samples as a PNG holds them, of any kind.
struct PngRows {
  enum class Color : std::uint8_t { grey = 0, rgb = 2, rgb_and_alpha = 6 };

  int width = 0, height = 0, bits = 8;
  Color color = Color::rgb;
  const std::uint8_t* first = nullptr;

  std::size_t pixel_bytes() const {
    return std::size_t(bits / 8) * (color == Color::grey ? 1 : color == Color::rgb ? 3 : 4);
  }
  std::size_t row_bytes() const { return pixel_bytes() * std::size_t(width); }
};

// A PNG file of them, at a level of libdeflate: up to 2 with the quickest filter, which suits
// pictures, beyond with the one that each row suits best. There must be pixels.
std::string png_file(const PngRows& rows, int level);

}  // namespace organbake
