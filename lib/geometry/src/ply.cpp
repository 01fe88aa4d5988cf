// SPDX-License-Identifier: Apache-2.0
// PLY files (Turk 1994), text and binary, read word by word or number by number. Counts in the
// header are checked against the length of the file before anything is made that large.
#include "organbake/geometry/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/scalar_type.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/polygon.h"

namespace organbake {
namespace {

constexpr std::string_view kOurComment = " millimetres, LPS";  // write_ply's

const std::map<std::string_view, ScalarType> kTypes = {
    {"char", ScalarType::int8},      {"int8", ScalarType::int8},
    {"uchar", ScalarType::uint8},    {"uint8", ScalarType::uint8},
    {"short", ScalarType::int16},    {"int16", ScalarType::int16},
    {"ushort", ScalarType::uint16},  {"uint16", ScalarType::uint16},
    {"int", ScalarType::int32},      {"int32", ScalarType::int32},
    {"uint", ScalarType::uint32},    {"uint32", ScalarType::uint32},
    {"float", ScalarType::float32},  {"float32", ScalarType::float32},
    {"double", ScalarType::float64}, {"float64", ScalarType::float64}};

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::float32;
  std::optional<ScalarType> list_count;  // the count's type, for a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

std::string_view next_word(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return rest = {};
  const std::size_t end = std::min(rest.find_first_of(" \t", begin), rest.size());
  const std::string_view result = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return result;
}

// The header and then the file's numbers, one after the other. All members throw BadDataError
// naming the file where it ends early, holds no number where one must be, or claims more than its
// bytes can hold.
class PlyScanner {
 public:
  // Reads the header; numbers begin behind it.
  PlyScanner(std::span<const std::byte> bytes, std::string name)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(std::move(name)) {
    if (line() != "ply") fail("is not a PLY file");
    for (;;) {
      std::string_view rest = line();
      const std::string_view key = next_word(rest);
      if (key == "end_header") break;
      if (key == "format") set_format(next_word(rest));
      if (key == "comment") is_ours_ = is_ours_ || rest == kOurComment;
      if (key == "element") add_element(rest);
      if (key == "property") add_property(rest);
    }
  }

  const std::string& name() const { return name_; }
  const std::vector<PlyElement>& elements() const { return elements_; }
  // Whether write_ply() wrote it, by its comment.
  bool is_ours() const { return is_ours_; }

  double number(ScalarType type) {
    if (ascii_) return ascii_number();
    const std::size_t width = bytes_of(type);
    if (text_.size() - position_ < width)
      fail("ends early, at byte " + std::to_string(text_.size()));
    const char* const at = text_.data() + position_;
    position_ += width;
    return with_scalar_type(
        type, [&](auto zero) { return static_cast<double>(bytes_as<decltype(zero)>(at, swaps_)); });
  }

  // How many numbers of the property follow: one, or as many as its list says.
  std::size_t count_of(const PlyProperty& property) {
    if (!property.list_count) return 1;
    const double count = number(*property.list_count);
    if (!(count >= 0 && count <= static_cast<double>(text_.size() - position_)))
      fail("claims a list of " + std::to_string(count) + " entries");
    return static_cast<std::size_t>(count);
  }

  void skip_row(const PlyElement& element) {
    for (const PlyProperty& property : element.properties)
      for (std::size_t left = count_of(property); left > 0; --left) number(property.type);
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw BadDataError(name_ + ": " + message);
  }

 private:
  std::string_view line() {
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string_view::npos) fail("the PLY header does not end");
    std::string_view result = text_.substr(position_, end - position_);
    position_ = end + 1;
    if (result.ends_with('\r')) result.remove_suffix(1);
    return result;
  }

  ScalarType scalar_type(std::string_view type) const {
    const auto found = kTypes.find(type);
    if (found == kTypes.end()) fail("unknown PLY type '" + std::string(type) + "'");
    return found->second;
  }

  void set_format(std::string_view format) {
    ascii_ = format == "ascii";
    swaps_ = format == "binary_big_endian";
    if (!ascii_ && !swaps_ && format != "binary_little_endian")
      fail("PLY format '" + std::string(format) + "' is not known");
  }

  void add_element(std::string_view rest) {
    PlyElement element;
    element.name = next_word(rest);
    const auto count = number_in<std::size_t>(next_word(rest));
    if (!count) fail("element " + element.name + " has no count");
    // Every row takes at least a byte, so a count beyond the file's size is a lie.
    if (*count > text_.size() || *count > std::numeric_limits<std::uint32_t>::max())
      fail("claims " + std::to_string(*count) + " of " + element.name + " in " +
           std::to_string(text_.size()) + " bytes");
    element.count = *count;
    elements_.push_back(std::move(element));
  }

  void add_property(std::string_view rest) {
    if (elements_.empty()) fail("a property stands before any element");
    PlyProperty property;
    std::string_view type = next_word(rest);
    if (type == "list") {
      property.list_count = scalar_type(next_word(rest));
      type = next_word(rest);
    }
    property.type = scalar_type(type);
    property.name = next_word(rest);
    elements_.back().properties.push_back(std::move(property));
  }

  double ascii_number() {
    position_ = std::min(text_.find_first_not_of(" \t\r\n", position_), text_.size());
    double value = 0;
    const std::size_t length = read_number(text_.substr(position_), value);
    if (length == 0) fail("has no number at byte " + std::to_string(position_));
    position_ += length;
    return value;
  }

  std::string_view text_;
  std::string name_;
  std::size_t position_ = 0;
  std::vector<PlyElement> elements_;
  bool ascii_ = false;
  bool swaps_ = false;  // bytes are in the other order than the machine's
  bool is_ours_ = false;
};

class PlyMeshReader {
 public:
  PlyMeshReader(std::span<const std::byte> bytes, const std::string& name) : ply_(bytes, name) {}

  TriangleMesh read() {
    for (const PlyElement& element : ply_.elements()) {
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "face" || element.name == "tristrips") {
        read_faces(element, element.name == "tristrips");
      } else {
        for (std::size_t i = 0; i < element.count; ++i) ply_.skip_row(element);
      }
    }
    cut_polygons();
    check_mesh(mesh_, ply_.name());
    if (mesh_.colors.empty() && !polygon_colors_.empty()) take_face_colors();
    return std::move(mesh_);
  }

 private:
  // Which of x, y, z, red, green, blue each property is, −1 for none; and how colours are scaled.
  struct Slots {
    std::vector<int> of_property;
    std::array<bool, 6> there{};
    ColorScale scale = ColorScale::number;
    bool has_color() const { return there[3] && there[4] && there[5]; }
  };

  static int slot_of(std::string_view name) {
    constexpr std::array<std::string_view, 6> kWanted = {"x", "y", "z", "red", "green", "blue"};
    constexpr std::array<std::string_view, 3> kShort = {"r", "g", "b"};
    for (const std::string_view prefix : {"diffuse_", "vertex_"})
      if (name.starts_with(prefix)) name.remove_prefix(prefix.size());
    const auto full = std::find(kWanted.begin(), kWanted.end(), name);
    if (full != kWanted.end()) return static_cast<int>(full - kWanted.begin());
    const auto letter = std::find(kShort.begin(), kShort.end(), name);
    return letter == kShort.end() ? -1 : 3 + static_cast<int>(letter - kShort.begin());
  }

  Slots slots(const PlyElement& element) const {
    Slots slots;
    for (const PlyProperty& property : element.properties) {
      int slot = property.list_count ? -1 : slot_of(property.name);
      if (slot >= 0 && slots.there[slot]) slot = -1;  // the first of several colours is taken
      slots.of_property.push_back(slot);
      if (slot < 0) continue;
      slots.there[slot] = true;
      if (slot < 3) continue;
      slots.scale = property.type == ScalarType::uint8                   ? ColorScale::byte
                    : property.type == ScalarType::uint16                ? ColorScale::two_bytes
                    : ply_.is_ours() && is_floating_point(property.type) ? ColorScale::linear
                                                                         : ColorScale::number;
    }
    return slots;
  }

  void read_vertices(const PlyElement& element) {
    const Slots slots = this->slots(element);
    if (!slots.there[0] || !slots.there[1] || !slots.there[2])
      ply_.fail("has vertices without x, y and z");
    std::vector<Eigen::Vector3d> colors;
    mesh_.vertices.reserve(element.count);
    if (slots.has_color()) colors.reserve(element.count);
    for (std::size_t v = 0; v < element.count; ++v) {
      std::array<double, 6> row{};
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const std::size_t count = ply_.count_of(property);
        for (std::size_t i = 0; i < count; ++i) {
          const double value = ply_.number(property.type);
          if (slots.of_property[p] >= 0) row[slots.of_property[p]] = value;
        }
      }
      mesh_.vertices.emplace_back(row[0], row[1], row[2]);
      if (slots.has_color()) colors.emplace_back(row[3], row[4], row[5]);
    }
    mesh_.colors = linear_colors(colors, slots.scale);
  }

  // Faces may stand before the vertices, so that polygons are cut when all is read.
  void read_faces(const PlyElement& element, bool are_strips) {
    const Slots slots = this->slots(element);
    std::vector<Eigen::Vector3d> colors;
    for (std::size_t f = 0; f < element.count; ++f) {
      Eigen::Vector3d color = Eigen::Vector3d::Zero();
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const bool corners = property.list_count && property.name.starts_with("vertex_ind");
        const std::size_t count = ply_.count_of(property);
        for (std::size_t i = 0; i < count; ++i) {
          const double value = ply_.number(property.type);
          if (corners && are_strips && value == -1) {
            end_polygon(true);  // −1 ends a strip, another follows in the same list
          } else if (corners) {
            corners_.push_back(vertex_index(value, f));
          } else if (slots.of_property[p] >= 3) {
            color[slots.of_property[p] - 3] = value;
          }
        }
      }
      end_polygon(are_strips);
      if (slots.has_color() && !are_strips) colors.push_back(color);
    }
    if (!are_strips) polygon_colors_ = linear_colors(colors, slots.scale);
  }

  void end_polygon(bool is_strip) { polygons_.push_back({corners_.size(), is_strip}); }

  void cut_polygons() {
    std::size_t begin = 0;
    mesh_.faces.reserve(polygons_.size());
    for (std::size_t p = 0; p < polygons_.size(); ++p) {
      const auto [end, is_strip] = polygons_[p];
      const std::span<const std::uint32_t> corners(corners_.data() + begin, end - begin);
      if (is_strip) {
        cut_strip(corners, mesh_.faces);
      } else {
        cut_polygon(mesh_.vertices, corners, mesh_.faces);
      }
      polygon_of_face_.resize(mesh_.faces.size(), static_cast<std::uint32_t>(p));
      begin = end;
    }
  }

  void take_face_colors() {
    std::vector<Eigen::Vector3f> colors;
    colors.reserve(mesh_.faces.size());
    for (const std::uint32_t polygon : polygon_of_face_) {
      if (polygon >= polygon_colors_.size()) return;  // strips besides: no colour for all
      colors.push_back(polygon_colors_[polygon]);
    }
    mesh_.colors = vertex_from_face_colors(mesh_.faces, colors, mesh_.vertices.size());
  }

  std::uint32_t vertex_index(double value, std::size_t face) const {
    if (!(value >= 0 && value <= 4294967295.0))
      ply_.fail("face " + std::to_string(face) + " uses vertex " + std::to_string(value));
    return static_cast<std::uint32_t>(value);
  }

  PlyScanner ply_;
  struct Polygon {
    std::size_t end;  // in corners_; it begins where the one before ends
    bool is_strip;
  };
  std::vector<std::uint32_t> corners_;
  std::vector<Polygon> polygons_;
  std::vector<std::uint32_t> polygon_of_face_;
  std::vector<Eigen::Vector3f> polygon_colors_;
  TriangleMesh mesh_;
};

static_assert(std::endian::native == std::endian::little, "PLY is written as memory lies");

template <typename T>
void append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

std::string header(const TriangleMesh& mesh) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\ncomment millimetres, LPS\nelement vertex " +
      std::to_string(mesh.vertices.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\n";
  if (!mesh.colors.empty())
    text += "property float red\nproperty float green\nproperty float blue\n";
  return text + "element face " + std::to_string(mesh.faces.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace

TriangleMesh parse_ply(std::span<const std::byte> bytes, const std::string& name) {
  return PlyMeshReader(bytes, name).read();
}

TriangleMesh read_ply(const std::filesystem::path& path) {
  return parse_ply(read_file(path), path.string());
}

std::string serialise_ply(const TriangleMesh& mesh) {
  std::string bytes = header(mesh);
  bytes.reserve(bytes.size() + mesh.vertices.size() * 36 + mesh.faces.size() * 13);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    append(bytes, mesh.vertices[v].data(), 3);
    if (!mesh.colors.empty()) append(bytes, mesh.colors[v].data(), 3);
  }
  for (const Face& face : mesh.faces) {
    bytes += '\x03';
    append(bytes, face.data(), 3);
  }
  return bytes;
}

void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh) {
  write_file_atomically(path, serialise_ply(mesh));
}

}  // namespace organbake
