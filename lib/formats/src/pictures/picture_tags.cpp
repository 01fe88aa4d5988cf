// SPDX-License-Identifier: GPL-3.0-or-later
#include "pictures/picture_decoders.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace organbake {
namespace {

// Numbers of either byte order from bytes that may end anywhere; what lies behind the end is 0.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes, bool little = false)
      : bytes_(bytes), little_(little) {}

  std::uint32_t number(std::size_t at, int size) const {
    std::uint32_t value = 0;
    for (int i = 0; i < size; ++i) {
      const std::size_t k = at + static_cast<std::size_t>(little_ ? size - 1 - i : i);
      value = value << 8 | (k < bytes_.size() ? std::to_integer<std::uint32_t>(bytes_[k]) : 0);
    }
    return value;
  }
  bool holds(std::size_t at, std::string_view text) const {
    return at + text.size() <= bytes_.size() &&
           std::memcmp(bytes_.data() + at, text.data(), text.size()) == 0;
  }
  std::span<const std::byte> from(std::size_t at, std::size_t count) const {
    return at < bytes_.size() ? bytes_.subspan(at, std::min(count, bytes_.size() - at))
                              : std::span<const std::byte>{};
  }
  std::size_t size() const { return bytes_.size(); }

 private:
  std::span<const std::byte> bytes_;
  bool little_;
};

// Of a TIFF block, as Exif has it: the first directory's entries are of 12 bytes.
Turn turn_of(std::span<const std::byte> tiff) {
  constexpr std::uint32_t kOrientation = 0x0112, kEntry = 12;
  const bool little = Bytes(tiff).holds(0, "II");
  const Bytes block(tiff, little);
  const std::size_t directory = block.number(4, 4);
  const std::uint32_t entries = block.number(directory, 2);
  for (std::uint32_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + std::size_t{kEntry} * i;
    if (entry + kEntry > block.size()) break;
    if (block.number(entry, 2) != kOrientation) continue;
    const std::uint32_t value = block.number(entry + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<Turn>(value) : Turn::none;
  }
  return Turn::none;
}

// Pixels per length across and down: where there are more, a pixel is smaller.
double aspect_of(std::uint32_t across, std::uint32_t down) {
  return across > 0 && down > 0 ? static_cast<double>(down) / across : 1;
}

}  // namespace

PictureTags jpeg_tags(std::span<const std::byte> file) {
  constexpr std::uint32_t kApp0 = 0xFFE0, kApp1 = 0xFFE1, kStartOfScan = 0xFFDA;
  constexpr std::size_t kExif = 6;
  PictureTags tags;
  const Bytes jpeg(file);
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    const std::uint32_t marker = jpeg.number(at, 2), length = jpeg.number(at + 2, 2);
    if (marker < 0xFF00 || marker == kStartOfScan || length < 2) break;
    if (marker == kApp0 && jpeg.holds(at + 4, std::string_view("JFIF\0", 5)))
      tags.pixel_aspect = aspect_of(jpeg.number(at + 12, 2), jpeg.number(at + 14, 2));
    if (marker == kApp1 && jpeg.holds(at + 4, std::string_view("Exif\0\0", kExif)))
      tags.turn = turn_of(jpeg.from(at + 4 + kExif, length - 2));
    at += 2 + length;
  }
  return tags;
}

PictureTags png_tags(std::span<const std::byte> file) {
  constexpr std::size_t kSignature = 8, kAroundData = 12;
  PictureTags tags;
  const Bytes png(file);
  for (std::size_t at = kSignature; at + kAroundData <= png.size();) {
    const std::uint32_t length = png.number(at, 4);
    const std::size_t data = at + 8;
    if (png.holds(at + 4, "pHYs"))
      tags.pixel_aspect = aspect_of(png.number(data, 4), png.number(data + 4, 4));
    if (png.holds(at + 4, "eXIf")) tags.turn = turn_of(png.from(data, length));
    if (png.holds(at + 4, "IEND")) break;
    at += kAroundData + length;
  }
  return tags;
}

}  // namespace organbake
