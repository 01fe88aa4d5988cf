// SPDX-License-Identifier: Apache-2.0
// The header of an OpenEXR file, checked.
#include "exr_header.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "organbake/core/scalar_type.h"

namespace organbake {
namespace {

void refuse(bool bad, const std::string& why) {
  if (bad) throw std::runtime_error(why);
}

// How many lines a block has, and how much a byte of the file can at most unpack to: deflate's
// largest ratio is 1032; PXR24 drops a float's last byte before it; PIZ's Huffman codes take ten
// bits for 256 equal halves; of a block of 8 × 8 floats DWA keeps two halves, which it deflates.
struct Packing {
  const char* name;
  std::int64_t block_lines, most_ratio;  // 0: not read
};
constexpr std::array<Packing, 10> kPackings = {{{"NONE", 1, 1},
                                                {"RLE", 1, 0},
                                                {"ZIPS", 1, 1040},
                                                {"ZIP", 16, 1040},
                                                {"PIZ", 32, 512},
                                                {"PXR24", 16, 1400},
                                                {"B44", 32, 0},
                                                {"B44A", 32, 0},
                                                {"DWAA", 32, 70'000},
                                                {"DWAB", 256, 70'000}}};

class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::byte> file)
      : rest_(reinterpret_cast<const char*>(file.data()), file.size()) {}
  explicit HeaderReader(std::string_view value) : rest_(value) {}

  std::string_view take(std::size_t count) {
    refuse(count > rest_.size(), "ends within its header");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  // A text that ends with a zero, which is passed over.
  std::string_view text() {
    const std::size_t end = rest_.find('\0');
    refuse(end == rest_.npos, "ends within its header");
    const std::string_view taken = take(end);
    take(1);
    return taken;
  }
  bool empty() const { return rest_.empty(); }
  std::int32_t number() { return bytes_as<std::int32_t>(take(sizeof(std::int32_t)).data()); }

 private:
  std::string_view rest_;
};

void check_version(std::int32_t version) {
  constexpr std::int32_t kTiled = 0x200, kDeep = 0x800, kMultiPart = 0x1000;
  refuse((version & 0xFF) != 2, "is of an unknown version of the format");
  refuse((version & kTiled) != 0, "is tiled; scan lines are read here");
  refuse((version & kDeep) != 0, "holds deep data");
  refuse((version & kMultiPart) != 0, "has several parts");
}

// OpenEXR reads a value by its type, whatever size it is said to have.
struct FixedSize {
  std::string_view type;
  std::size_t bytes;
};
constexpr FixedSize kFixedSizes[] = {{"box2f", 16},      {"box2i", 16},   {"chromaticities", 32},
                                     {"compression", 1}, {"double", 8},   {"envmap", 1},
                                     {"float", 4},       {"int", 4},      {"keycode", 28},
                                     {"lineOrder", 1},   {"m33d", 72},    {"m33f", 36},
                                     {"m44d", 128},      {"m44f", 64},    {"rational", 8},
                                     {"timecode", 8},    {"v2d", 16},     {"v2f", 8},
                                     {"v2i", 8},         {"v3d", 24},     {"v3f", 12},
                                     {"v3i", 12},        {"tiledesc", 9}, {"deepImageState", 1}};

// A small picture of the picture: RGBA.
bool is_preview(HeaderReader value, std::size_t bytes) {
  if (bytes < 8) return false;
  const auto width = static_cast<std::uint32_t>(value.number());
  const auto height = static_cast<std::uint32_t>(value.number());
  return static_cast<double>(width) * height * 4 + 8 == static_cast<double>(bytes);
}

// Texts with their lengths before them.
bool is_list_of_texts(HeaderReader value) {
  while (!value.empty()) {
    const std::int32_t length = value.number();
    if (length < 0) return false;
    value.take(static_cast<std::size_t>(length));
  }
  return true;
}

// Each channel's name, and what OpenEXR takes for its type and its sampling; an empty name ends it.
bool is_list_of_channels(HeaderReader value) {
  constexpr std::size_t kOfEach = 16;
  while (!value.text().empty()) value.take(kOfEach);
  return value.empty();
}

void check_value(std::string_view name, std::string_view type, std::string_view value) {
  const auto* fixed = std::find_if(std::begin(kFixedSizes), std::end(kFixedSizes),
                                   [&](const FixedSize& one) { return one.type == type; });
  const bool sound = fixed != std::end(kFixedSizes) ? value.size() == fixed->bytes
                     : type == "preview"            ? is_preview(HeaderReader(value), value.size())
                     : type == "chlist"             ? is_list_of_channels(HeaderReader(value))
                     : type == "stringvector"       ? is_list_of_texts(HeaderReader(value))
                     : type == "floatvector"        ? value.size() % sizeof(float) == 0
                                                    : true;
  refuse(!sound, "has the attribute '" + std::string(name) + "' of the wrong size");
  // Names of what a renderer drew: nothing that is read here has one.
  refuse(type == "idmanifest", "has a manifest of identifiers; save it without");
}

// The bytes of a pixel, unpacked, of all its channels.
std::int64_t pixel_bytes(HeaderReader channels) {
  constexpr std::int32_t kUint = 0, kHalf = 1, kFloat = 2;
  constexpr std::size_t kPerceptualFlag = 4;
  std::int64_t bytes = 0;
  for (std::string_view name; !(name = channels.text()).empty();) {
    const std::int32_t type = channels.number();
    channels.take(kPerceptualFlag);
    const std::int32_t across = channels.number(), down = channels.number();
    refuse(across != 1 || down != 1, "channel '" + std::string(name) + "' is subsampled");
    refuse(type != kUint && type != kHalf && type != kFloat,
           "channel '" + std::string(name) + "' is of an unknown type");
    bytes += type == kHalf ? 2 : 4;
  }
  return bytes;
}

// What decides how much memory a file takes.
struct Layout {
  std::optional<std::int64_t> width, height, pixel_bytes;
  std::optional<Packing> packing;
};

void read_window(HeaderReader value, Layout& layout) {
  const std::int64_t left = value.number(), top = value.number();
  const std::int64_t right = value.number(), bottom = value.number();
  layout.width = right - left + 1;
  layout.height = bottom - top + 1;
}

void read_packing(HeaderReader value, Layout& layout) {
  const auto number = static_cast<unsigned char>(value.take(1)[0]);
  refuse(number >= kPackings.size(), "is compressed in an unknown way");
  layout.packing = kPackings[number];
  refuse(layout.packing->most_ratio == 0, std::string("is compressed by ") + layout.packing->name +
                                              ", which is not read; save it with ZIP");
}

Layout layout_of(HeaderReader header) {
  Layout layout;
  for (std::string_view name; !(name = header.text()).empty();) {
    const std::string_view type = header.text();  // OpenEXR holds it against the name
    const std::int32_t size = header.number();
    refuse(size < 0, "has an attribute of negative size");
    const std::string_view bytes = header.take(static_cast<std::size_t>(size));
    check_value(name, type, bytes);
    const HeaderReader value(bytes);
    // OpenEXR takes the last of two of a name; nothing honest has two.
    const auto once = [&](bool there) {
      refuse(there, "has the attribute '" + std::string(name) + "' twice");
    };
    if (name == "dataWindow") once(layout.width.has_value()), read_window(value, layout);
    if (name == "compression") once(layout.packing.has_value()), read_packing(value, layout);
    if (name == "channels") {
      once(layout.pixel_bytes.has_value());
      layout.pixel_bytes = pixel_bytes(value);
    }
  }
  refuse(!layout.width || !layout.packing || !layout.pixel_bytes,
         "lacks its channels, its data window or its compression");
  return layout;
}

}  // namespace

void check_exr_header(std::span<const std::byte> file, std::size_t max_pixels) {
  constexpr std::int32_t kMagic = 20000630;
  constexpr std::int64_t kWidest = std::numeric_limits<int>::max() / 64;
  constexpr std::int64_t kLeastBlock = 16;  // its offset in the table, its line, its size
  HeaderReader header(file);
  refuse(file.size() < 8 || header.number() != kMagic, "does not begin as one");
  check_version(header.number());
  const Layout layout = layout_of(header);
  const std::int64_t width = *layout.width, height = *layout.height;
  const auto bytes = static_cast<std::int64_t>(file.size());
  const std::string claim =
      "claims " + std::to_string(width) + " × " + std::to_string(height) + " pixels";
  refuse(width < 1 || height < 1 || width > kWidest ||
             static_cast<std::uint64_t>(height) > max_pixels / static_cast<std::uint64_t>(width),
         claim);
  const std::int64_t blocks = (height - 1) / layout.packing->block_lines + 1;
  const double unpacked = static_cast<double>(width) * static_cast<double>(height) *
                          static_cast<double>(*layout.pixel_bytes);
  // OpenEXR counts the bytes of a block in ints.
  const double block = static_cast<double>(width) * static_cast<double>(*layout.pixel_bytes) *
                       static_cast<double>(layout.packing->block_lines);
  refuse(block > std::numeric_limits<int>::max(), claim + ", which are too many in one line");
  const double most = static_cast<double>(bytes) * static_cast<double>(layout.packing->most_ratio);
  refuse(blocks > bytes / kLeastBlock || unpacked > most,
         claim + ", which " + std::to_string(bytes) + " bytes cannot hold");
}

}  // namespace organbake
