// SPDX-License-Identifier: Apache-2.0
#include "exr_zip.h"

#include <ImathConfig.h>
#include <half.h>
#include <libdeflate.h>

#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>

namespace organbake {
namespace {

static_assert(std::endian::native == std::endian::little);

struct FreeDecompressor {
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

void inflate(std::span<const char> packed, std::span<std::uint8_t> bytes) {
  thread_local const std::unique_ptr<libdeflate_decompressor, FreeDecompressor> decompressor(
      libdeflate_alloc_decompressor());
  if (!decompressor) throw std::bad_alloc();
  // Without a place for the size found, any other than the expected one is an error.
  const libdeflate_result result = libdeflate_zlib_decompress(
      decompressor.get(), packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr);
  if (result != LIBDEFLATE_SUCCESS) throw std::runtime_error("holds a damaged block");
}

// Each byte was stored as its difference to the one before, plus 128. Sums of eight at once: even
// and odd bytes in 16-bit lanes, where a multiplication adds up all lanes below.
void undo_differences(std::span<std::uint8_t> bytes) {
  constexpr std::uint64_t kLow = 0x00FF00FF00FF00FF, kLanes = 0x0001000100010001;
  constexpr std::uint64_t kBias = 0x8080808080808080;
  std::uint64_t before = 128;  // the first byte has no predecessor, and no bias
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word;
    std::memcpy(&word, &bytes[i], 8);
    word ^= kBias;  // − 128 modulo 256
    const std::uint64_t even = (word & kLow) * kLanes, odd = (word >> 8 & kLow) * kLanes;
    const std::uint64_t sums = even + odd, start = before * kLanes;
    word = ((even + (odd << 16) + start) & kLow) | ((sums + start) & kLow) << 8;
    before = (before + (sums >> 48)) & 255;
    std::memcpy(&bytes[i], &word, 8);
  }
  for (; i < bytes.size(); ++i) {
    before = (before + (bytes[i] ^ 128u)) & 255;
    bytes[i] = static_cast<std::uint8_t>(before);
  }
}

std::uint16_t two_bytes(const std::uint8_t* at) {
  std::uint16_t value;
  std::memcpy(&value, at, sizeof(value));
  return value;
}

// The block's even bytes stand in its first half, the odd ones in its second.
void join_words(const std::uint8_t* __restrict even, const std::uint8_t* __restrict odd, int count,
                std::uint32_t* __restrict out) {
  for (int k = 0; k < count; ++k) {
    const std::uint32_t e = two_bytes(even + 2 * k), o = two_bytes(odd + 2 * k);
    out[k] = (e & 255) | (o & 255) << 8 | (e >> 8) << 16 | (o >> 8) << 24;
  }
}

void join_halves(const std::uint8_t* __restrict even, const std::uint8_t* __restrict odd, int count,
                 float* __restrict out) {
  for (int k = 0; k < count; ++k) {
    out[k] = imath_half_to_float(static_cast<std::uint16_t>(even[k] | odd[k] << 8));
  }
}

}  // namespace

void unpack_exr_zip(std::span<const char> packed, const ExrLines& lines, int first_row,
                    int row_count) {
  thread_local std::vector<std::uint8_t> scratch;
  scratch.resize(lines.line_bytes * row_count);
  const std::span<std::uint8_t> bytes(scratch);
  const std::size_t half = bytes.size() / 2;  // values have 2 or 4 bytes: even
  if (packed.size() == bytes.size()) {        // did not shrink: stored as it is
    for (std::size_t i = 0; i < half; ++i) {
      bytes[i] = static_cast<std::uint8_t>(packed[2 * i]);
      bytes[half + i] = static_cast<std::uint8_t>(packed[2 * i + 1]);
    }
  } else {
    inflate(packed, bytes);
    undo_differences(bytes);
  }
  for (int row = 0; row < row_count; ++row) {
    for (const ExrPlane& plane : lines.planes) {
      const std::uint8_t* const even = &bytes[(lines.line_bytes * row + plane.line_offset) / 2];
      char* const out = plane.values + std::size_t{4} * lines.width * (first_row + row);
      if (plane.kind == ExrPlane::Kind::four_bytes) {
        join_words(even, even + half, lines.width, reinterpret_cast<std::uint32_t*>(out));
      } else {
        join_halves(even, even + half, lines.width, reinterpret_cast<float*>(out));
      }
    }
  }
}

}  // namespace organbake
