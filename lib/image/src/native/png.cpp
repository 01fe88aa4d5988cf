// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/png.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/srgb.h"
#include "png_rows.h"

namespace organbake {
namespace {

constexpr int kUsualLevel = 6;  // of compression

// libpng's simplified interface reports by value: no longjmp crosses our frames.
struct ReadState : png_image {
  ReadState() : png_image{} { version = PNG_IMAGE_VERSION; }
  ~ReadState() { png_image_free(this); }
};

PngRows rows_of(const Rgb8Image& image) {
  return {image.width, image.height, 8, PngRows::Color::rgb, image.pixels.data()};
}

struct Samples {
  int width = 0, height = 0;
  bool deep = false;                 // the file has 16 bits
  std::vector<std::uint8_t> values;  // R, G, B, A
};

// Whether no chunk claims more bytes than there are: libpng takes memory for some before it reads.
bool chunks_fit(std::span<const std::byte> file) {
  constexpr std::size_t kSignature = 8, kAroundData = 12;  // length, name and checksum
  for (std::size_t at = kSignature; at + kAroundData <= file.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i)
      length = length << 8 | std::to_integer<std::size_t>(file[at + i]);
    if (length > file.size() - at - kAroundData) return false;
    at += kAroundData + length;
  }
  return true;
}

// Whether its deflated rows can lie in the file, whose header has been read.
bool can_hold(std::span<const std::byte> file, std::uint32_t width, std::uint32_t height) {
  constexpr std::size_t kBitDepth = 24, kColorType = 25;  // bytes of the header
  constexpr double kDeflateRatio = 1040;                  // 1032, and headers
  const unsigned type = std::to_integer<unsigned>(file[kColorType]);
  const bool palette = (type & PNG_COLOR_MASK_PALETTE) != 0;
  const unsigned samples = palette ? 1
                                   : ((type & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1) +
                                         ((type & PNG_COLOR_MASK_ALPHA) != 0 ? 1 : 0);
  const double bits = std::to_integer<unsigned>(file[kBitDepth]) * samples;
  return (bits / 8 * width + 1) * height <= kDeflateRatio * static_cast<double>(file.size());
}

Samples decoded(std::span<const std::byte> bytes, const std::string& name, std::size_t max_pixels) {
  ReadState state;
  const auto fail = [&] { throw BadDataError(name + ": is not a readable PNG: " + state.message); };
  if (!chunks_fit(bytes))
    throw BadDataError(name + ": is not a readable PNG: a part of it is cut off");
  if (!png_image_begin_read_from_memory(&state, bytes.data(), bytes.size())) fail();
  if (state.height == 0 || state.width > max_pixels / state.height) {
    throw BadDataError(name + ": claims " + std::to_string(state.width) + " × " +
                       std::to_string(state.height) + " pixels");
  }
  if (!can_hold(bytes, state.width, state.height)) {
    throw BadDataError(name + ": is not a readable PNG: its " + std::to_string(bytes.size()) +
                       " bytes cannot hold " + std::to_string(state.width) + " × " +
                       std::to_string(state.height) + " pixels");
  }
  Samples samples{static_cast<int>(state.width),
                  static_cast<int>(state.height),
                  (state.format & PNG_FORMAT_FLAG_LINEAR) != 0,
                  {}};
  // Else libpng takes 16 bits without a gamma for linear, which no camera and no editor writes.
  state.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  state.format = PNG_FORMAT_RGBA;
  samples.values.resize(4 * std::size_t{state.width} * state.height);
  if (!png_image_finish_read(&state, nullptr, samples.values.data(), 0, nullptr)) fail();
  return samples;
}

Rgb8Image without_alpha(const Samples& samples) {
  Rgb8Image image(samples.width, samples.height);
  for (std::size_t k = 0; k < samples.values.size() / 4; ++k) {
    const std::uint8_t* pixel = &samples.values[4 * k];
    if (pixel[3] > 0) std::copy_n(pixel, 3, &image.pixels[3 * k]);
  }
  return image;
}

// 16-bit samples as the file has them. libpng's own conversion to linear light takes sRGB for a
// power of 2.2, which is 15 % off in the dark. What has a destructor lives here, outside setjmp.
struct DeepReader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::span<const std::byte> rest;
  std::vector<std::uint16_t> samples;  // R, G, B, A
  std::vector<png_bytep> rows;
  double gamma = 0;  // of the file's own; 0 = sRGB
  ~DeepReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void take_bytes(png_structp png, png_bytep target, png_size_t count) {
  auto& reader = *static_cast<DeepReader*>(png_get_io_ptr(png));
  if (count > reader.rest.size()) png_error(png, "ends early");
  std::memcpy(target, reader.rest.data(), count);
  reader.rest = reader.rest.subspan(count);
}

bool decode(DeepReader& reader) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_set_read_fn(reader.png, &reader, take_bytes);
  png_read_info(reader.png, reader.info);
  int intent = 0;
  if (!png_get_sRGB(reader.png, reader.info, &intent))
    png_get_gAMA(reader.png, reader.info, &reader.gamma);
  png_set_expand_16(reader.png);
  png_set_gray_to_rgb(reader.png);
  png_set_add_alpha(reader.png, 0xFFFF, PNG_FILLER_AFTER);
  png_set_swap(reader.png);  // x86 keeps the low byte first
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  const std::size_t row = 4 * std::size_t{png_get_image_width(reader.png, reader.info)};
  const std::size_t height = png_get_image_height(reader.png, reader.info);
  reader.samples.resize(row * height);
  for (std::size_t y = 0; y < height; ++y)
    reader.rows.push_back(reinterpret_cast<png_bytep>(&reader.samples[row * y]));
  png_read_image(reader.png, reader.rows.data());
  return true;
}

// Linear light of a file of 16 bits, 3 numbers a pixel, freed from alpha.
std::vector<float> deep_light(std::span<const std::byte> bytes, const std::string& name) {
  DeepReader reader;
  reader.rest = bytes;
  reader.png = png_create_read_struct(
      PNG_LIBPNG_VER_STRING, nullptr, [](png_structp png, png_const_charp) { png_longjmp(png, 1); },
      [](png_structp, png_const_charp) {});
  reader.info = reader.png ? png_create_info_struct(reader.png) : nullptr;
  if (!reader.info || !decode(reader)) throw BadDataError(name + ": is a damaged PNG of 16 bits");
  constexpr double kScreen = 1 / 2.2;  // what is written for sRGB by those who don't write sRGB
  const bool srgb = !(reader.gamma > 0) || std::abs(reader.gamma / kScreen - 1) < 0.05;
  std::vector<float> curve(0x10000);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const float share = static_cast<float>(i) / 0xFFFF;
    curve[i] = srgb ? linear_from_srgb(share) : std::pow(share, float(1 / reader.gamma));
  }
  std::vector<float> linear(reader.samples.size() / 4 * 3);
  for (std::size_t k = 0; k < reader.samples.size() / 4; ++k) {
    const std::uint16_t* pixel = &reader.samples[4 * k];
    for (int c = 0; c < 3; ++c) linear[3 * k + c] = pixel[3] > 0 ? curve[pixel[c]] : 0;
  }
  return linear;
}

// Larger sides than this libpng does not read, by itself.
constexpr int kLongestSide_px = 1'000'000;

std::string no_png_of(const PngRows& rows) {
  return "a PNG cannot hold an image of " + std::to_string(rows.width) + " × " +
         std::to_string(rows.height) + " pixels";
}

bool fits(const PngRows& rows) {
  return std::min(rows.width, rows.height) >= 1 &&
         std::max(rows.width, rows.height) <= kLongestSide_px;
}

std::string encoded_or_throw(const PngRows& rows, int level) {
  if (!fits(rows)) throw Error(ExitCode::internal, no_png_of(rows));
  return png_file(rows, level);
}

}  // namespace

Rgb8Image read_png(const std::filesystem::path& path, std::size_t max_pixels) {
  const std::vector<std::byte> bytes = read_file(path);
  return without_alpha(decoded(bytes, path.string(), max_pixels));
}

StoredPicture parse_png(std::span<const std::byte> bytes, const std::string& name,
                        std::size_t max_pixels) {
  const Samples color = decoded(bytes, name, max_pixels);
  StoredPicture picture(without_alpha(color));
  if (color.deep) picture.linear = deep_light(bytes, name);
  return picture;
}

std::string encode_png(const Rgb8Image& image, int compression_level) {
  return encoded_or_throw(rows_of(image), compression_level);
}

std::string encode_png(const Rgb8Image& image, std::span<const std::uint8_t> alpha) {
  std::vector<std::uint8_t> samples(4 * alpha.size());
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    std::copy_n(&image.pixels[3 * i], 3, &samples[4 * i]);
    samples[4 * i + 3] = alpha[i];
  }
  return encoded_or_throw(
      {image.width, image.height, 8, PngRows::Color::rgb_and_alpha, samples.data()}, kUsualLevel);
}

std::string encode_grey_png(int width, int height, std::span<const std::uint8_t> values,
                            int compression_level) {
  return encoded_or_throw({width, height, 8, PngRows::Color::grey, values.data()},
                          compression_level);
}

std::string encode_grey_png(int width, int height, std::span<const std::uint16_t> values) {
  std::vector<std::uint8_t> samples;
  samples.reserve(2 * values.size());
  for (const std::uint16_t value : values) {
    samples.push_back(static_cast<std::uint8_t>(value >> 8));
    samples.push_back(static_cast<std::uint8_t>(value & 0xFF));
  }
  return encoded_or_throw({width, height, 16, PngRows::Color::grey, samples.data()}, kUsualLevel);
}

void write_png(const std::filesystem::path& path, const Rgb8Image& image, int compression_level) {
  const PngRows rows = rows_of(image);
  if (!fits(rows)) throw IoError::writing(path, no_png_of(rows));
  write_file_atomically(path, png_file(rows, compression_level));
}

}  // namespace organbake
