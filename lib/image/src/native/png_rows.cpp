// SPDX-License-Identifier: Apache-2.0
// PNG files (ISO/IEC 15948) written by hand, for the sake of libdeflate, which packs them in half
// of zlib's time.
#include "png_rows.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <vector>

namespace organbake {
namespace {

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

}  // namespace

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

}  // namespace organbake
