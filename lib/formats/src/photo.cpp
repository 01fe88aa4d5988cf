// SPDX-License-Identifier: GPL-3.0-or-later
// Photographs as they lie on a disk: PNG, JPEG (libjpeg-turbo) and EXR, told apart by their first
// bytes, with the orientation and the pixels' aspect that Exif 2.32, JFIF and pHYs tell.
#include "organbake/formats/photo.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Decompressor = std::unique_ptr<std::remove_pointer_t<tjhandle>, Destroy>;

// Each scan passes over all pixels, however few bytes it has.
std::size_t scan_count(std::span<const std::byte> bytes) {
  std::size_t count = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i)
    count += bytes[i] == std::byte{0xFF} && bytes[i + 1] == std::byte{0xDA};
  return count;
}

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

constexpr float kWellExposed = 0.9F, kTooDark = 0.25F;

std::vector<float> numbers(const Channel& channel) {
  if (const auto* floats = std::get_if<std::vector<float>>(&channel.values)) return *floats;
  const auto& whole = channel.uints();
  return {whole.begin(), whole.end()};
}

// The channels that stand for red, green and blue; a grey one stands for all.
std::array<const Channel*, 3> color_channels(const ChannelImage& image, const std::string& name) {
  const std::array<const Channel*, 3> rgb = {image.find("R"), image.find("G"), image.find("B")};
  if (rgb[0] && rgb[1] && rgb[2]) return rgb;
  const Channel* grey = image.find("Y");
  if (!grey || image.find("RY") || image.find("BY"))
    throw BadDataError(name + ": holds no picture: the channels R, G, B or Y are needed");
  if (image.find("Z")) throw BadDataError(name + ": is a depth map (channels Y and Z), no picture");
  return {grey, grey, grey};
}

float exposure(const std::vector<float>& linear) {
  const float bright = quantile(linear, 0.999);
  if (!(bright > 0) || (bright <= 1 && bright >= kTooDark)) return 1;
  return kWellExposed / bright;
}

enum class PictureKind { png, jpeg, exr, other };

PictureKind kind_of(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path))
    throw NoInputError(path, "is a folder, a photograph (PNG or JPEG) is needed");
  const std::string magic = read_beginning(path, 4);
  if (magic == "\x89PNG") return PictureKind::png;
  if (magic.starts_with("\xFF\xD8\xFF")) return PictureKind::jpeg;
  if (magic == "\x76\x2F\x31\x01") return PictureKind::exr;
  return PictureKind::other;
}

// 8-bit RGB from a baseline or progressive JPEG (grey is spread over the channels). An Exif
// orientation is not applied: intrinsics belong to the pixels as the sensor gave them. Throws
// BadDataError for anything damaged, truncated, CMYK or too large.
Rgb8Image parse_jpeg(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kMostPixels = std::size_t{1} << 28;
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const Decompressor decompressor(tjInitDecompress());
  if (!decompressor) throw std::bad_alloc();
  int width = 0, height = 0, subsampling = 0, colorspace = 0;
  if (tjDecompressHeader3(decompressor.get(), data, bytes.size(), &width, &height, &subsampling,
                          &colorspace) != 0)
    throw BadDataError(name + ": not a JPEG image: " + tjGetErrorStr2(decompressor.get()));
  if (colorspace == TJCS_CMYK || colorspace == TJCS_YCCK)
    throw BadDataError(name + ": a CMYK JPEG; save it as RGB");
  if (static_cast<std::size_t>(width) * height > kMostPixels)
    throw BadDataError(name + ": " + std::to_string(width) + "×" + std::to_string(height) +
                       " pixels are more than the limit of " + std::to_string(kMostPixels));
  // However it is coded, a block of 8 × 8 pixels takes a bit at least.
  constexpr std::size_t kMostPixelsPerByte = 512;
  if (static_cast<std::size_t>(width) * height / kMostPixelsPerByte > bytes.size())
    throw BadDataError(name + ": damaged JPEG: " + std::to_string(bytes.size()) +
                       " bytes cannot hold " + std::to_string(width) + "×" +
                       std::to_string(height) + " pixels");
  constexpr std::size_t kMostScans = 100;  // encoders write about ten
  if (scan_count(bytes) > kMostScans)
    throw BadDataError(name + ": damaged JPEG: it comes in more than 100 scans");
  Rgb8Image image(width, height);
  // A warning means that libjpeg filled in what a damaged or truncated file lacks: grey areas that
  // look like data. It counts as failure here.
  if (tjDecompress2(decompressor.get(), data, bytes.size(), image.pixels.data(), width, 0, height,
                    TJPF_RGB, TJFLAG_ACCURATEDCT) != 0)
    throw BadDataError(name + ": damaged JPEG: " + tjGetErrorStr2(decompressor.get()));
  return image;
}

// Tells of a picture what its file says beside its pixels: Exif's orientation (Exif 2.32, tag
// 0x0112) and the aspect of pixels, a JPEG's by JFIF's densities and a PNG's by pHYs. Tags that are
// absent, damaged or senseless are not there; never throws.
void read_jpeg_tags(std::span<const std::byte> file, StoredPicture& picture) {
  constexpr std::uint32_t kApp0 = 0xFFE0, kApp1 = 0xFFE1, kStartOfScan = 0xFFDA;
  constexpr std::size_t kExif = 6;
  const Bytes jpeg(file);
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    const std::uint32_t marker = jpeg.number(at, 2), length = jpeg.number(at + 2, 2);
    if (marker < 0xFF00 || marker == kStartOfScan || length < 2) break;
    if (marker == kApp0 && jpeg.holds(at + 4, std::string_view("JFIF\0", 5)))
      picture.pixel_aspect = aspect_of(jpeg.number(at + 12, 2), jpeg.number(at + 14, 2));
    if (marker == kApp1 && jpeg.holds(at + 4, std::string_view("Exif\0\0", kExif)))
      picture.turn = turn_of(jpeg.from(at + 4 + kExif, length - 2));
    at += 2 + length;
  }
}

void read_png_tags(std::span<const std::byte> file, StoredPicture& picture) {
  constexpr std::size_t kSignature = 8, kAroundData = 12;
  const Bytes png(file);
  for (std::size_t at = kSignature; at + kAroundData <= png.size();) {
    const std::uint32_t length = png.number(at, 4);
    const std::size_t data = at + 8;
    if (png.holds(at + 4, "pHYs"))
      picture.pixel_aspect = aspect_of(png.number(data, 4), png.number(data + 4, 4));
    if (png.holds(at + 4, "eXIf")) picture.turn = turn_of(png.from(data, length));
    if (png.holds(at + 4, "IEND")) break;
    at += kAroundData + length;
  }
}

// An EXR image as a picture: R, G, B or a grey Y, in linear light as the format has it; where there
// is alpha, colours are freed from it. Its 8-bit copy is exposed so that the brightest of its
// thousand parts does not clip, unless it already lies well in 0…1. Throws BadDataError.
StoredPicture parse_exr_picture(std::span<const std::byte> bytes, const std::string& name) {
  const ChannelImage image = parse_exr(bytes, name);
  const auto channels = color_channels(image, name);
  const Channel* alpha = image.find("A");
  const std::vector<float> covered = alpha ? numbers(*alpha) : std::vector<float>{};
  StoredPicture picture(Rgb8Image(image.width, image.height));
  picture.pixel_aspect = image.pixel_aspect;
  picture.linear.resize(3 * image.pixel_count());
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float> values = numbers(*channels[c]);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const float share = alpha ? covered[k] : 1;
      const float value = share > 0 ? values[k] / share : 0;
      picture.linear[3 * k + c] = std::isfinite(value) ? std::max(value, 0.F) : 0;
    }
  }
  const float gain = exposure(picture.linear);
  for (std::size_t i = 0; i < picture.linear.size(); ++i)
    picture.color.pixels[i] = srgb8_from_linear(gain * picture.linear[i]);
  return picture;
}

}  // namespace

Rgb8Image read_photo(const std::filesystem::path& path) {
  const PictureKind kind = kind_of(path);
  if (kind == PictureKind::png) return read_png(path);
  if (kind == PictureKind::jpeg) return parse_jpeg(read_file(path), path.string());
  throw BadDataError(path, "is neither a PNG nor a JPEG image");
}

StoredPicture read_picture(const std::filesystem::path& path) {
  const PictureKind kind = kind_of(path);
  if (kind == PictureKind::other)
    throw BadDataError(path, "is neither a PNG, a JPEG nor an EXR image");
  const std::vector<std::byte> bytes = read_file(path);
  if (kind == PictureKind::exr) return parse_exr_picture(bytes, path.string());
  const bool png = kind == PictureKind::png;
  StoredPicture picture =
      png ? parse_png(bytes, path.string()) : StoredPicture(parse_jpeg(bytes, path.string()));
  png ? read_png_tags(bytes, picture) : read_jpeg_tags(bytes, picture);
  return picture;
}

}  // namespace organbake
