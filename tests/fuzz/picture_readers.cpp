// SPDX-License-Identifier: GPL-3.0-or-later
#include <turbojpeg.h>

#include "fuzz/readers.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/formats/photo.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"

namespace organbake {
namespace {

// Told by the first bytes; all that a picture's file says is looked at.
void read_any_picture(std::span<const std::byte> bytes, const InputFolder& folder) {
  read_picture(folder.file("picture", bytes));
}

// A bundle's map, whose camera says how large it may be.
void read_map(std::span<const std::byte> bytes, const InputFolder&) {
  constexpr std::size_t kMostPixels = 1u << 22;
  parse_exr(bytes, "map.exr", kMostPixels);
}

ChannelImage small_map() {
  ChannelImage image{5, 3, {}};
  std::vector<float> values;
  std::vector<std::uint32_t> faces;
  for (int i = 0; i < 15; ++i) {
    values.push_back(0.125f * static_cast<float>(i));
    faces.push_back(static_cast<std::uint32_t>(i % 4));
  }
  for (const char* name : {"B", "G", "R"}) image.channels.push_back({name, values, true});
  image.channels.push_back({"Y", values, false});
  image.channels.push_back({"face", faces, false});
  return image;
}

std::string exr_bytes(const ChannelImage& image, ExrCompression compression) {
  const TemporaryFolder folder;
  write_exr(folder.path() / "a.exr", image, {.compression = compression});
  return read_text_file(folder.path() / "a.exr");
}

Seeds map_seeds() {
  Seeds seeds;
  for (const auto kind : {ExrCompression::none, ExrCompression::zip, ExrCompression::piz,
                          ExrCompression::pxr24, ExrCompression::dwaa})
    seeds.push_back(exr_bytes(small_map(), kind));
  return seeds;
}

Rgb8Image gradient(int width, int height) {
  Rgb8Image image(width, height);
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = static_cast<std::uint8_t>(7 * i);
  return image;
}

Seeds png_seeds() {
  std::vector<std::uint8_t> bytes(35);
  std::vector<std::uint16_t> deep(35);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(7 * i);
    deep[i] = static_cast<std::uint16_t>(1800 * i);
  }
  return {encode_png(gradient(7, 5)), encode_png(gradient(7, 5), bytes),
          encode_grey_png(7, 5, bytes), encode_grey_png(7, 5, deep)};
}

std::string as_jpeg(const Rgb8Image& image, TJSAMP subsampling, int flags) {
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  const tjhandle compressor = tjInitCompress();
  tjCompress2(compressor, image.pixels.data(), image.width, 0, image.height, TJPF_RGB, &bytes,
              &count, subsampling, 70, flags);
  const std::string jpeg(reinterpret_cast<char*>(bytes), count);
  tjFree(bytes);
  tjDestroy(compressor);
  return jpeg;
}

// Exif's orientation 6, big-endian, behind the JFIF segment.
std::string turned(const std::string& jpeg) {
  const std::string exif(
      "\xFF\xE1\0\x22"
      "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06"
      "\0\0\0\0\0\0",
      36);
  return jpeg.substr(0, 20) + exif + jpeg.substr(20);
}

Seeds jpeg_seeds() {
  const Rgb8Image image = gradient(19, 18);
  return {as_jpeg(image, TJSAMP_444, 0), as_jpeg(image, TJSAMP_420, TJFLAG_PROGRESSIVE),
          as_jpeg(image, TJSAMP_GRAY, 0), turned(as_jpeg(image, TJSAMP_422, 0))};
}

Seeds exr_picture_seeds() {
  ChannelImage grey{4, 4, {{"Y", std::vector<float>(16, 0.5f), true}}};
  ChannelImage alpha{4, 4, {}};
  for (const char* name : {"A", "B", "G", "R"})
    alpha.channels.push_back({name, std::vector<float>(16, 0.5f), true});
  return {exr_bytes(small_map(), ExrCompression::zip), exr_bytes(grey, ExrCompression::piz),
          exr_bytes(alpha, ExrCompression::none)};
}

const Words kExr = {"channels",
                    "chlist",
                    "compression",
                    "dataWindow",
                    "displayWindow",
                    "box2i",
                    "lineOrder",
                    "pixelAspectRatio",
                    "screenWindowCenter",
                    "screenWindowWidth",
                    "tiles",
                    "tiledesc",
                    "type",
                    "scanlineimage",
                    "preview",
                    "chunkCount",
                    "multiView",
                    "\x76\x2f\x31\x01",
                    "worldToCamera",
                    "m44f",
                    "A",
                    "R",
                    "Y"};

}  // namespace

std::vector<FuzzReader> picture_readers() {
  return {
      {"exr-map", read_map, map_seeds, kExr, 3200},
      {"exr-picture", read_any_picture, exr_picture_seeds, kExr, 3200},
      {"png",
       read_any_picture,
       png_seeds,
       {"IHDR", "PLTE", "IDAT", "IEND", "tRNS", "gAMA", "sRGB", "cHRM", "pHYs", "eXIf", "iCCP",
        "sBIT", "acTL"},
       3200},
      {"jpeg",
       read_any_picture,
       jpeg_seeds,
       {"\xFF\xC0", "\xFF\xC2", "\xFF\xC4", "\xFF\xC9", "\xFF\xDA", "\xFF\xDB", "\xFF\xDD",
        "\xFF\xD0", "\xFF\xD9", "\xFF\xE1", "\xFF\xEE", "Exif", "JFIF", "Adobe", "II*", "MM"},
       3200},
  };
}

}  // namespace organbake
