// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace organbake {

// One named plane, row-major, top row first. `half` says how a float plane is stored on disk.
struct Channel {
  std::string name;
  std::variant<std::vector<float>, std::vector<std::uint32_t>> values;
  bool half = false;

  const std::vector<float>& floats() const { return std::get<std::vector<float>>(values); }
  const std::vector<std::uint32_t>& uints() const {
    return std::get<std::vector<std::uint32_t>>(values);
  }
};

// An image of named planes of one size.
struct ChannelImage {
  int width = 0;
  int height = 0;
  std::vector<Channel> channels;
  double pixel_aspect = 1;  // a pixel's width / its height, where a file tells it

  std::size_t pixel_count() const { return static_cast<std::size_t>(width) * height; }
  const Channel* find(std::string_view name) const;
  // Throws BadDataError naming `source` when the channel is missing or of the other kind.
  const std::vector<float>& floats(std::string_view name, const std::string& source) const;
  const std::vector<std::uint32_t>& uints(std::string_view name, const std::string& source) const;
  // The same, which the image then no longer has.
  std::vector<float> take_floats(std::string_view name, const std::string& source);
  std::vector<std::uint32_t> take_uints(std::string_view name, const std::string& source);
};

// 8-bit sRGB pixels, 3 bytes each (R, G, B), top row first.
struct Rgb8Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  Rgb8Image() = default;
  Rgb8Image(int w, int h) : width(w), height(h), pixels(std::size_t(3) * w * h) {}
  std::uint8_t* at(int x, int y) { return &pixels[3 * (std::size_t(y) * width + x)]; }
  const std::uint8_t* at(int x, int y) const { return &pixels[3 * (std::size_t(y) * width + x)]; }
};

// Two pictures, their upper edges in one line.
Rgb8Image side_by_side(const Rgb8Image& left, const Rgb8Image& right);

}  // namespace organbake
