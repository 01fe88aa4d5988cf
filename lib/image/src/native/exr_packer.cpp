// SPDX-License-Identifier: Apache-2.0
#include "exr_packer.h"

#include <libdeflate.h>

#include <cstring>
#include <new>

namespace organbake {
namespace {

// ZIP: the even bytes before the odd ones, and of each its difference to the one before plus 128.
// Into other places, so that both go by whole vectors.
void split_bytes(const char* __restrict pairs, std::size_t count, std::uint8_t* __restrict even,
                 std::uint8_t* __restrict odd) {
  for (std::size_t i = 0; i < count; ++i) {
    even[i] = static_cast<std::uint8_t>(pairs[2 * i]);
    odd[i] = static_cast<std::uint8_t>(pairs[2 * i + 1]);
  }
}

void take_differences(const std::uint8_t* __restrict bytes, std::size_t count,
                      std::uint8_t* __restrict differences) {
  if (count > 0) differences[0] = bytes[0];
  for (std::size_t i = 1; i < count; ++i)
    differences[i] = static_cast<std::uint8_t>(bytes[i] - bytes[i - 1] + 128);
}

// PXR24: of each line of a channel the differences from value to value, by planes of their bytes,
// the highest first.
template <int kBytes, class Value, class Code>
std::uint8_t* put_planes(const char* line, std::size_t width, const Code& code, std::uint8_t* to) {
  std::uint32_t before = 0;
  for (std::size_t i = 0; i < width; ++i) {
    Value value;
    std::memcpy(&value, line + i * sizeof(Value), sizeof(Value));
    const std::uint32_t now = code(value), change = now - before;
    for (int b = 0; b < kBytes; ++b)
      to[static_cast<std::size_t>(b) * width + i] =
          static_cast<std::uint8_t>(change >> 8 * (kBytes - 1 - b));
    before = now;
  }
  return to + kBytes * width;
}

// The nearest float of 24 bits, whose last 8 are left out; infinity, and what would become it, are
// only cut, and what is no number stays none.
std::uint32_t float24(std::uint32_t bits) {
  constexpr std::uint32_t kSign = 0x80000000, kInfinity = 0x7f800000;
  const std::uint32_t size = bits & ~kSign, rounded = size + (size & 0x80), sign = bits & kSign;
  if (size > kInfinity) return (sign | size) >> 8 | ((size & 0x7fff00) == 0);
  return (sign | (rounded < kInfinity ? rounded : size)) >> 8;
}

std::uint8_t* put_channel(const char* line, std::size_t width, Imf::PixelType type,
                          std::uint8_t* to) {
  const auto as_it_is = [](std::uint32_t value) { return value; };
  if (type == Imf::HALF) return put_planes<2, std::uint16_t>(line, width, as_it_is, to);
  if (type == Imf::UINT) return put_planes<4, std::uint32_t>(line, width, as_it_is, to);
  return put_planes<3, std::uint32_t>(line, width, float24, to);
}

}  // namespace

ExrPacker::ExrPacker(Method method, int level) : method_(method) {
  compressor_.reset(libdeflate_alloc_compressor(level));
  if (!compressor_) throw std::bad_alloc();
}

void ExrPacker::Free::operator()(libdeflate_compressor* compressor) const {
  libdeflate_free_compressor(compressor);
}

std::span<const char> ExrPacker::pack(std::span<const char> lines,
                                      std::span<const Imf::PixelType> types, std::size_t width) {
  differences_.resize(lines.size());
  std::span<const std::uint8_t> told = differences_;
  if (method_ == Method::zip) {
    const std::size_t half = lines.size() / 2;
    halves_.resize(lines.size());
    split_bytes(lines.data(), half, halves_.data(), halves_.data() + half);
    take_differences(halves_.data(), halves_.size(), differences_.data());
  } else {
    std::uint8_t* end = differences_.data();
    for (const char* line = lines.data(); line != lines.data() + lines.size();)
      for (const Imf::PixelType type : types) {
        end = put_channel(line, width, type, end);
        line += width * (type == Imf::HALF ? 2 : 4);
      }
    told = told.first(static_cast<std::size_t>(end - told.data()));
  }
  packed_.resize(lines.size());
  // Nothing is written, and 0 the answer, when there is too little room.
  const std::size_t size = libdeflate_zlib_compress(compressor_.get(), told.data(), told.size(),
                                                    packed_.data(), packed_.size());
  if (size == 0 || size >= lines.size()) return lines;
  return std::span<const char>(packed_).first(size);
}

}  // namespace organbake
