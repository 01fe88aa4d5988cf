// SPDX-License-Identifier: Apache-2.0
// PLY files, text and binary, and colours as files write them, in whole numbers or shares.
#include "organbake/geometry/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "organbake/core/files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/polygon.h"
#include "organbake/geometry/written_color.h"
#include "ply_scanner.h"

namespace organbake {
namespace {

double highest(const std::vector<Eigen::Vector3d>& colors) {
  double most = 0;
  for (const Eigen::Vector3d& c : colors) most = std::max(most, c.maxCoeff());
  return most;
}

double full_scale(const std::vector<Eigen::Vector3d>& written, ColorScale scale) {
  if (scale == ColorScale::byte) return 255;
  if (scale == ColorScale::two_bytes) return 65535;
  const double most = highest(written);
  return most <= 1 ? 1 : most <= 255 ? 255 : 65535;
}

// In float, as images are: geometry stands above image and its tables.
float linear(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

}  // namespace

std::vector<Eigen::Vector3f> linear_colors(const std::vector<Eigen::Vector3d>& written,
                                           ColorScale scale) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(written.size());
  const auto full =
      static_cast<float>(scale == ColorScale::linear ? 1.0 : full_scale(written, scale));
  for (const Eigen::Vector3d& w : written) {
    const Eigen::Vector3f color = w.cast<float>();
    colors.push_back(
        scale == ColorScale::linear ? color : Eigen::Vector3f((color / full).unaryExpr(&linear)));
  }
  return colors;
}

std::vector<Eigen::Vector3f> vertex_from_face_colors(
    const std::vector<std::array<std::uint32_t, 3>>& faces,
    const std::vector<Eigen::Vector3f>& face_colors, std::size_t vertex_count) {
  std::vector<Eigen::Vector3f> colors(vertex_count, Eigen::Vector3f::Zero());
  std::vector<float> uses(vertex_count, 0.0f);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t v : faces[f]) {
      colors[v] += face_colors[f];
      ++uses[v];
    }
  }
  for (std::size_t v = 0; v < vertex_count; ++v) colors[v] /= std::max(uses[v], 1.0f);
  return colors;
}

namespace {

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
    for (const std::string_view prefix : {"diffuse_", "vertex_"}) {
      if (name.starts_with(prefix)) name.remove_prefix(prefix.size());
    }
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
    if (!(value >= 0 && value <= 4294967295.0)) {
      ply_.fail("face " + std::to_string(face) + " uses vertex " + std::to_string(value));
    }
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
  if (!mesh.colors.empty()) {
    text += "property float red\nproperty float green\nproperty float blue\n";
  }
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
