// SPDX-License-Identifier: Apache-2.0
// PNG files (ISO/IEC 15948): read by libpng, and written by hand, for the sake of libdeflate, which
// packs them in half of zlib's time.
#include "organbake/image/png.h"

#include <libdeflate.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

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

void put_number(std::string& to, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(value >> shift & 255);
}

void put_chunk(std::string& file, const char* name, std::string_view data) {
  put_number(file, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = file.size();
  file.append(name).append(data);
  put_number(file, libdeflate_crc32(0, file.data() + begin, file.size() - begin));
}

// What the light of numbers is: sRGB, and the same for those who don't know its name.
void put_srgb(std::string& file) {
  put_chunk(file, "sRGB", std::string(1, '\0'));  // perceptual
  std::string gamma, primaries;
  put_number(gamma, 45455);
  for (const std::uint32_t value : {31270u, 32900u, 64000u, 33000u, 30000u, 60000u, 15000u, 6000u})
    put_number(primaries, value);
  put_chunk(file, "gAMA", gamma);
  put_chunk(file, "cHRM", primaries);
}

int paeth(int left, int up, int corner) {
  const int across = std::abs(up - corner), down = std::abs(left - corner),
            both = std::abs(left + up - 2 * corner);
  return across <= down && across <= both ? left : down <= both ? up : corner;
}

enum Filter : std::uint8_t { kNone, kSub, kUp, kAverage, kPaeth };

// A row's bytes less what a filter guesses of them. Both rows begin behind a pixel of zeros.
void filter_row(Filter filter, const std::uint8_t* __restrict row,
                const std::uint8_t* __restrict above, std::size_t pixel, std::size_t count,
                std::uint8_t* __restrict to) {
  const std::uint8_t *left = row - pixel, *corner = above - pixel;
  const auto put = [&](const auto& guess) {
    for (std::size_t i = 0; i < count; ++i) to[i] = static_cast<std::uint8_t>(row[i] - guess(i));
  };
  if (filter == kNone) put([](std::size_t) { return 0; });
  if (filter == kSub) put([&](std::size_t i) { return left[i]; });
  if (filter == kUp) put([&](std::size_t i) { return above[i]; });
  if (filter == kAverage) put([&](std::size_t i) { return (left[i] + above[i]) / 2; });
  if (filter == kPaeth) put([&](std::size_t i) { return paeth(left[i], above[i], corner[i]); });
}

// Small differences pack well, either way.
std::uint64_t sum_of_sizes(std::span<const std::uint8_t> differences) {
  std::uint64_t sum = 0;
  for (const std::uint8_t byte : differences) sum += std::min<unsigned>(byte, 256u - byte);
  return sum;
}

// All rows, each behind its filter's number.
std::vector<std::uint8_t> filtered(const PngRows& rows, bool quick) {
  const std::size_t pixel = rows.pixel_bytes(), count = rows.row_bytes();
  std::vector<std::uint8_t> all((count + 1) * std::size_t(rows.height)), row(pixel + count),
      above(pixel + count), tried(count);
  for (int y = 0; y < rows.height; ++y) {
    std::copy_n(rows.first + count * std::size_t(y), count, row.begin() + std::ptrdiff_t(pixel));
    std::uint8_t* const to = &all[(count + 1) * std::size_t(y)];
    std::uint64_t least = ~std::uint64_t{0};
    for (const Filter filter : {kSub, kNone, kUp, kAverage, kPaeth}) {
      filter_row(filter, &row[pixel], &above[pixel], pixel, count, tried.data());
      const std::uint64_t size = quick ? 0 : sum_of_sizes(tried);
      if (size < least) {
        least = size;
        to[0] = filter;
        std::copy(tried.begin(), tried.end(), to + 1);
      }
      if (quick) break;
    }
    row.swap(above);
  }
  return all;
}

std::string packed(const std::vector<std::uint8_t>& bytes, int level) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string data(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  data.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), data.data(),
                                       data.size()));
  return data;
}

// A PNG file of them, at a level of libdeflate: up to 2 with the quickest filter, which suits
// pictures, beyond with the one that each row suits best. There must be pixels.
std::string png_file(const PngRows& rows, int level) {
  constexpr int kQuickest = 2;
  std::string file("\x89PNG\r\n\x1a\n"), header;
  put_number(header, static_cast<std::uint32_t>(rows.width));
  put_number(header, static_cast<std::uint32_t>(rows.height));
  header += static_cast<char>(rows.bits);
  header += static_cast<char>(rows.color);
  header.append(3, '\0');  // deflate, the five filters, not interlaced
  put_chunk(file, "IHDR", header);
  // Greys are masks and depths here: numbers, no light.
  if (rows.color != PngRows::Color::grey) put_srgb(file);
  put_chunk(file, "IDAT", packed(filtered(rows, level <= kQuickest), level));
  put_chunk(file, "IEND", {});
  return file;
}

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
  if (state.height == 0 || state.width > max_pixels / state.height)
    throw BadDataError(name + ": claims " + std::to_string(state.width) + " × " +
                       std::to_string(state.height) + " pixels");
  if (!can_hold(bytes, state.width, state.height))
    throw BadDataError(name + ": is not a readable PNG: its " + std::to_string(bytes.size()) +
                       " bytes cannot hold " + std::to_string(state.width) + " × " +
                       std::to_string(state.height) + " pixels");
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
