// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/jpeg.h"

#include <turbojpeg.h>

#include <memory>
#include <type_traits>

#include "core/error.h"
#include "core/files.h"

namespace organbake {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Decompressor = std::unique_ptr<std::remove_pointer_t<tjhandle>, Destroy>;

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
