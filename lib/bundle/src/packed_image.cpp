// SPDX-License-Identifier: Apache-2.0
// Writes and reads images of named planes without any library. The bytes of like weight of all
// numbers stand together, because neighbouring pixels agree in their high bytes, which deflate then
// packs well.
#include "packed_image.h"

#include <array>
#include <cstring>

#include "organbake/bundle/packed_bytes.h"

namespace organbake {
namespace {

constexpr std::size_t kWord = 4;  // bytes of a float or uint
constexpr std::uint32_t kMostChannels = 64, kLargestSide = 1 << 24;
enum class Kind : std::uint8_t { floats, halves, uints };

template <class Number>
void add_planes(const std::vector<Number>& numbers, PackedWriter& out) {
  std::vector<std::byte> plane(numbers.size());
  for (std::size_t b = 0; b < kWord; ++b) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      plane[i] = reinterpret_cast<const std::byte*>(&numbers[i])[b];
    out.add(plane);
  }
}

template <class Number>
std::vector<Number> read_planes(std::size_t count, PackedReader& in) {
  std::array<std::span<const std::byte>, kWord> planes;
  for (auto& plane : planes) plane = in.take(count);
  std::vector<Number> numbers(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<std::byte, kWord> bytes{planes[0][i], planes[1][i], planes[2][i],
                                             planes[3][i]};
    std::memcpy(&numbers[i], bytes.data(), kWord);
  }
  return numbers;
}

}  // namespace

std::vector<std::byte> packed_image(const ChannelImage& image) {
  PackedWriter out;
  out.add(static_cast<std::uint32_t>(image.width));
  out.add(static_cast<std::uint32_t>(image.height));
  out.add(static_cast<std::uint32_t>(image.channels.size()));
  for (const Channel& channel : image.channels) {
    const bool is_float = std::holds_alternative<std::vector<float>>(channel.values);
    out.add(!is_float ? Kind::uints : channel.half ? Kind::halves : Kind::floats);
    out.add(static_cast<std::uint8_t>(channel.name.size()));
    out.add(std::as_bytes(std::span(channel.name.data(), channel.name.size())));
    if (is_float) {
      add_planes(channel.floats(), out);
    } else {
      add_planes(channel.uints(), out);
    }
  }
  return out.take();
}

ChannelImage unpacked_image(std::span<const std::byte> bytes, const std::string& name) {
  PackedReader in(bytes, name);
  const auto width = in.next<std::uint32_t>(), height = in.next<std::uint32_t>();
  const auto channels = in.next<std::uint32_t>();
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide ||
      channels > kMostChannels) {
    in.fail("has an impossible size");
  }
  const std::uint64_t pixels = std::uint64_t{width} * height;
  if (pixels * kWord * channels > bytes.size()) in.fail("claims more pixels than it has bytes");
  ChannelImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  for (std::uint32_t c = 0; c < channels; ++c) {
    const auto kind = in.next<Kind>();
    if (kind > Kind::uints) in.fail("has a channel of no known kind");
    const auto letters = in.take(in.next<std::uint8_t>());
    Channel channel;
    channel.name.assign(reinterpret_cast<const char*>(letters.data()), letters.size());
    channel.half = kind == Kind::halves;
    if (kind == Kind::uints) {
      channel.values = read_planes<std::uint32_t>(static_cast<std::size_t>(pixels), in);
    } else {
      channel.values = read_planes<float>(static_cast<std::size_t>(pixels), in);
    }
    image.channels.push_back(std::move(channel));
  }
  in.end();
  return image;
}

}  // namespace organbake
