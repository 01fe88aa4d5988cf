// SPDX-License-Identifier: GPL-3.0-or-later
#include "pictures/picture_decoders.h"

#include <turbojpeg.h>

#include <memory>
#include <type_traits>

#include "organbake/core/error.h"
#include "organbake/core/files.h"

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

}  // namespace

Rgb8Image read_jpeg(const std::filesystem::path& path, std::size_t max_pixels) {
  return parse_jpeg(read_file(path), path.string(), max_pixels);
}

Rgb8Image parse_jpeg(std::span<const std::byte> bytes, const std::string& name,
                     std::size_t max_pixels) {
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const Decompressor decompressor(tjInitDecompress());
  if (!decompressor) throw std::bad_alloc();
  int width = 0, height = 0, subsampling = 0, colorspace = 0;
  if (tjDecompressHeader3(decompressor.get(), data, bytes.size(), &width, &height, &subsampling,
                          &colorspace) != 0) {
    throw BadDataError(name + ": not a JPEG image: " + tjGetErrorStr2(decompressor.get()));
  }
  if (colorspace == TJCS_CMYK || colorspace == TJCS_YCCK) {
    throw BadDataError(name + ": a CMYK JPEG; save it as RGB");
  }
  if (static_cast<std::size_t>(width) * height > max_pixels) {
    throw BadDataError(name + ": " + std::to_string(width) + "×" + std::to_string(height) +
                       " pixels are more than the limit of " + std::to_string(max_pixels));
  }
  // However it is coded, a block of 8 × 8 pixels takes a bit at least.
  constexpr std::size_t kMostPixelsPerByte = 512;
  if (static_cast<std::size_t>(width) * height / kMostPixelsPerByte > bytes.size()) {
    throw BadDataError(name + ": damaged JPEG: " + std::to_string(bytes.size()) +
                       " bytes cannot hold " + std::to_string(width) + "×" +
                       std::to_string(height) + " pixels");
  }
  constexpr std::size_t kMostScans = 100;  // encoders write about ten
  if (scan_count(bytes) > kMostScans)
    throw BadDataError(name + ": damaged JPEG: it comes in more than 100 scans");
  Rgb8Image image(width, height);
  // A warning means that libjpeg filled in what a damaged or truncated file lacks: grey areas that
  // look like data. It counts as failure here.
  if (tjDecompress2(decompressor.get(), data, bytes.size(), image.pixels.data(), width, 0, height,
                    TJPF_RGB, TJFLAG_ACCURATEDCT) != 0) {
    throw BadDataError(name + ": damaged JPEG: " + tjGetErrorStr2(decompressor.get()));
  }
  return image;
}

}  // namespace organbake
