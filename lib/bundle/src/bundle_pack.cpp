// SPDX-License-Identifier: Apache-2.0
// Reads a bundle from whatever holds its files, a folder or the pack of a web page, so that both go
// through the same checks. And writes and reads the pack of a web page: contents with sizes and
// a checksum (CRC-32 of ISO 3309), then gzip streams that a browser can fetch one by one. Sizes
// that the file claims are checked against its length before memory is taken for them.
#include "organbake/bundle/bundle_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/bundle/bundle_pack.h"
#include "organbake/core/error.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/channel_image.h"

namespace organbake {
namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

Bundle read_frame(const BundleFiles& files, Manifest manifest) {
  Bundle bundle;
  bundle.manifest = std::move(manifest);
  const auto text = [&](const char* file) { return text_of(files.bytes(file)); };
  bundle.proxy = parse_ply(files.bytes("proxy.ply"), files.where("proxy.ply"));
  if (bundle.proxy.faces.empty()) throw BadDataError(files.where("proxy.ply") + ": has no faces");
  bundle.cameras = cameras_from_json(text("cameras.json"), files.where("cameras.json"));
  if (bundle.cameras.cameras.empty() ||
      bundle.cameras.manifold.directions.size() != bundle.cameras.cameras.size()) {
    throw BadDataError(files.where("cameras.json") +
                       ": needs cameras and their viewing projection manifold");
  }
  bundle.mechanics = mechanics_from_json(text("mechanics.json"), files.where("mechanics.json"),
                                         bundle.proxy.vertices.size());
  if (files.has(kSkinFile))
    bundle.skin = skin_from_image(files.image(kSkinFile), files.where(kSkinFile), bundle.proxy);
  bundle.base = base_layer_from_image(files.image("base.exr"), files.where("base.exr"),
                                      static_cast<std::uint32_t>(shell_face_count(bundle)));
  bundle.maps.resize(bundle.cameras.cameras.size());
  if (files.has(kLightingFile))
    bundle.lighting = lighting_from_json(text(kLightingFile), files.where(kLightingFile));
  return bundle;
}

namespace {

// Writes and reads images of named planes without any library. The bytes of like weight of all
// numbers stand together, because neighbouring pixels agree in their high bytes, which deflate then
// packs well.

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

// An image of named planes in a form that needs no library to read and that deflate packs well:
// exact, plane by plane, the numbers' lowest bytes first, then the next ones.
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

// Throws BadDataError, beginning with `name`.
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

constexpr std::string_view kMagic = "ORGANPK1";
constexpr std::size_t kFixed = 8 + 4 + 4, kPerPart = 8;  // magic, count, checksum; sizes
// The most that a stream of deflate makes of a byte.
constexpr std::uint64_t kMostInflation = 1032;
constexpr const char* kFrameName = "name";
// What is kept of the base layer's heights: the rest is noise to who packs it.
constexpr float kPerMm = 1024;

// CRC-32 of ISO 3309, as gzip has it: of a few hundred bytes, so bit by bit.
std::uint32_t checksum(std::span<const std::byte> bytes) {
  std::uint32_t crc = ~0u;
  for (const std::byte byte : bytes) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
  }
  return ~crc;
}

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

void add_file(std::string_view name, std::span<const std::byte> bytes, PackedWriter& out) {
  out.add(static_cast<std::uint8_t>(name.size()));
  out.add(bytes_of(name));
  out.add(static_cast<std::uint32_t>(bytes.size()));
  out.add(bytes);
}

class PackedFiles : public BundleFiles {
 public:
  explicit PackedFiles(std::span<const std::byte> bytes) {
    PackedReader in(bytes, "the pack's frame");
    const auto count = in.next<std::uint32_t>();
    constexpr std::uint32_t kMostFiles = 16;
    if (count > kMostFiles) in.fail("claims " + std::to_string(count) + " files");
    for (std::uint32_t f = 0; f < count; ++f) {
      const auto letters = in.take(in.next<std::uint8_t>());
      const std::string name(reinterpret_cast<const char*>(letters.data()), letters.size());
      if (!files_.emplace(name, in.take(in.next<std::uint32_t>())).second)
        in.fail("has '" + name + "' twice");
    }
    in.end();
  }

  bool has(const std::string& file) const override { return files_.contains(file); }
  std::vector<std::byte> bytes(const std::string& file) const override {
    const auto found = files_.find(file);
    if (found == files_.end()) throw BadDataError(where(file) + ": is missing");
    return {found->second.begin(), found->second.end()};
  }
  ChannelImage image(const std::string& file) const override {
    return unpacked_image(bytes(file), where(file));
  }
  std::string where(const std::string& file) const override { return "the pack's " + file; }

 private:
  std::map<std::string, std::span<const std::byte>> files_;
};

}  // namespace

std::size_t pack_contents_bytes(std::size_t parts) { return kFixed + kPerPart * parts; }

std::vector<std::byte> pack_contents(const std::vector<PackPart>& parts) {
  PackedWriter out;
  out.add(bytes_of(kMagic));
  out.add(static_cast<std::uint32_t>(parts.size()));
  for (const PackPart& part : parts) out.add(part.packed_bytes), out.add(part.bytes);
  out.add(checksum(out.bytes()));
  return out.take();
}

std::vector<PackPart> contents_of_pack(std::span<const std::byte> beginning,
                                       std::uint64_t total_bytes) {
  PackedReader in(beginning, "the pack");
  const auto magic = in.take(kMagic.size());
  if (!std::equal(magic.begin(), magic.end(), bytes_of(kMagic).begin()))
    in.fail("is no organ that was exported for a page, or one of another version");
  const auto count = in.next<std::uint32_t>();
  if (count < 2 || count > kMostPackParts) in.fail("claims " + std::to_string(count) + " parts");
  std::vector<PackPart> parts(count);
  std::uint64_t offset = pack_contents_bytes(count);
  for (PackPart& part : parts) {
    part = {offset, in.next<std::uint32_t>(), in.next<std::uint32_t>()};
    offset += part.packed_bytes;
  }
  const std::size_t guarded = pack_contents_bytes(count) - sizeof(std::uint32_t);
  if (in.next<std::uint32_t>() != checksum(beginning.first(guarded)))
    in.fail("does not match its own checksum");
  if (offset != total_bytes)
    in.fail("is " + std::to_string(total_bytes) + " bytes, its parts make " +
            std::to_string(offset));
  for (const PackPart& part : parts) {
    if (part.bytes > kMostInflation * part.packed_bytes)
      in.fail("claims a part that no stream of its size inflates to");
  }
  return parts;
}

std::vector<std::byte> packed_frame(const Bundle& bundle) {
  BaseLayer base = bundle.base;
  for (float& height : base.height_mm) height = std::round(height * kPerMm) / kPerMm;
  const std::string proxy = serialise_ply(bundle.proxy), cameras = cameras_to_json(bundle.cameras),
                    mechanics = mechanics_to_json(bundle.mechanics);
  PackedWriter out;
  out.add(std::uint32_t{5} + (bundle.skin ? 1 : 0) + (bundle.lighting ? 1 : 0));
  add_file(kFrameName, bytes_of(bundle.manifest.name), out);
  add_file("proxy.ply", bytes_of(proxy), out);
  add_file("cameras.json", bytes_of(cameras), out);
  add_file("mechanics.json", bytes_of(mechanics), out);
  add_file("base.exr", packed_image(base_layer_to_image(base)), out);
  if (bundle.skin) add_file(kSkinFile, packed_image(skin_to_image(*bundle.skin)), out);
  if (bundle.lighting) {
    const std::string lighting = lighting_to_json(*bundle.lighting);
    add_file(kLightingFile, bytes_of(lighting), out);
  }
  return out.take();
}

Bundle unpacked_frame(std::span<const std::byte> bytes) {
  const PackedFiles files(bytes);
  const std::vector<std::byte> name = files.bytes(kFrameName);
  Manifest manifest;
  manifest.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  return read_frame(files, std::move(manifest));
}

}  // namespace organbake
