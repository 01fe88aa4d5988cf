// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/textured_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "geometry/shell_map.h"
#include "image/srgb.h"

namespace organbake {
namespace {

constexpr const char* kMaterial = "tissue";

// Every face has a square block of the texture: node (i, j) at texel (i, j), and one texel more
// beside the nodes, which filters blend with along the block's diagonal and border.
class Atlas {
 public:
  explicit Atlas(const BaseLayer& base)
      : base_(base),
        side_(base.steps + 2),
        columns_(static_cast<std::uint32_t>(std::ceil(std::sqrt(double(base.face_count))))) {
    const std::uint32_t rows = (base.face_count + columns_ - 1) / columns_;
    width_ = columns_ * side_;
    height_ = rows * side_;
  }

  Eigen::Vector2d coordinate(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    return {(left(face) + i + 0.5) / width_, 1 - (top(face) + j + 0.5) / height_};
  }

  Rgb8Image texture() const {
    Rgb8Image image(static_cast<int>(width_), static_cast<int>(height_));
    for (std::uint32_t face = 0; face < base_.face_count; ++face) {
      for (std::uint32_t j = 0; j < side_; ++j) {
        for (std::uint32_t i = 0; i < side_; ++i) {
          const Eigen::Vector3f color = color_at(face, i, j);
          std::uint8_t* pixel =
              image.at(static_cast<int>(left(face) + i), static_cast<int>(top(face) + j));
          for (int c = 0; c < 3; ++c) pixel[c] = srgb8_from_linear(color[c]);
        }
      }
    }
    return image;
  }

 private:
  std::uint32_t left(std::uint32_t face) const { return face % columns_ * side_; }
  std::uint32_t top(std::uint32_t face) const { return face / columns_ * side_; }

  Eigen::Vector3f node(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    return base_
        .color[std::size_t(face) * base_.nodes_per_face() + base_node_index(base_.steps, i, j)];
  }
  // Beyond the diagonal: the nearest nodes', from both sides of the texel.
  Eigen::Vector3f color_at(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    const std::uint32_t n = base_.steps;
    if (i + j <= n) return node(face, i, j);
    const std::uint32_t beyond = i + j - n;
    const std::uint32_t row = j >= (beyond + 1) / 2 ? j - (beyond + 1) / 2 : 0;
    const std::uint32_t other = j >= beyond / 2 ? j - beyond / 2 : 0;
    const auto clamped = [&](std::uint32_t at) { return std::min(at, n); };
    const std::uint32_t a = clamped(row), b = clamped(other);
    return 0.5f * (node(face, std::min(i, n - a), a) + node(face, std::min(i, n - b), b));
  }

  const BaseLayer& base_;
  std::uint32_t side_, columns_, width_ = 0, height_ = 0;
};

// Numbers the nodes so that faces share those on their common corners and edges. A node is known by
// its shares of the proxy's vertices; one inside a face is that face's own.
class Nodes {
 public:
  Nodes(const TriangleMesh& proxy, std::uint32_t steps) : proxy_(proxy), steps_(steps) {}

  // The vertex of node (i, j) of a face; `place` is taken when it is the first to come there.
  std::uint32_t vertex(std::uint32_t face, std::uint32_t i, std::uint32_t j,
                       const Eigen::Vector3d& place) {
    const Face& corners = proxy_.faces[face];
    const std::uint32_t k = steps_ - i - j;
    std::array<std::array<std::uint32_t, 2>, 3> shares = {
        {{corners[0], k}, {corners[1], i}, {corners[2], j}}};
    for (auto& [vertex, share] : shares)
      if (share == 0) vertex = 0;
    std::sort(shares.begin(), shares.end());
    const std::uint32_t owner = i > 0 && j > 0 && k > 0 ? face : 0;
    const auto [at, is_new] =
        known_.emplace(std::pair(shares, owner), static_cast<std::uint32_t>(places_.size()));
    if (is_new) places_.push_back(place);
    return at->second;
  }
  std::vector<Eigen::Vector3d> take_places() { return std::move(places_); }

 private:
  const TriangleMesh& proxy_;
  std::uint32_t steps_;
  std::map<std::pair<std::array<std::array<std::uint32_t, 2>, 3>, std::uint32_t>, std::uint32_t>
      known_;
  std::vector<Eigen::Vector3d> places_;
};

}  // namespace

TexturedMesh textured_base(const TriangleMesh& proxy, const BaseLayer& base) {
  if (base.steps < 1 || base.face_count != proxy.faces.size() ||
      base.height_mm.size() != std::size_t(base.face_count) * base.nodes_per_face()) {
    throw BadDataError("base layer: is not of this proxy");
  }
  const std::vector<ShellMatrix> shells = shell_matrices(proxy);
  const Atlas atlas(base);
  Nodes vertices(proxy, base.steps);
  TexturedMesh mesh;
  const std::uint32_t n = base.steps;
  for (std::uint32_t face = 0; face < base.face_count; ++face) {
    std::vector<TexturedMesh::Corner> nodes(base.nodes_per_face());
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t j = 0; i + j <= n; ++j) {
        const std::uint32_t node = base_node_index(n, i, j);
        const double height = base.height_mm[std::size_t(face) * nodes.size() + node];
        const Eigen::Vector3d place =
            shell_point(shells[face], double(i) / n, double(j) / n, height);
        nodes[node] = {vertices.vertex(face, i, j, place),
                       static_cast<std::uint32_t>(mesh.coordinates.size())};
        mesh.coordinates.push_back(atlas.coordinate(face, i, j));
      }
    }
    const auto at = [&](std::uint32_t i, std::uint32_t j) {
      return nodes[base_node_index(n, i, j)];
    };
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; i + j < n; ++j) {
        mesh.faces.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + j + 1 < n) mesh.faces.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    }
  }
  mesh.vertices = vertices.take_places();
  mesh.texture = atlas.texture();
  return mesh;
}

std::string obj_text(const TexturedMesh& mesh, const std::string& material_file) {
  std::string text = "# millimetres, LPS\nmtllib " + material_file + "\nusemtl " + kMaterial + "\n";
  constexpr int kDigits = 6;
  for (const Eigen::Vector3d& v : mesh.vertices)
    text += "v " + to_text(v.x(), kDigits) + " " + to_text(v.y(), kDigits) + " " +
            to_text(v.z(), kDigits) + "\n";
  for (const Eigen::Vector2d& t : mesh.coordinates)
    text += "vt " + to_text(t.x(), kDigits) + " " + to_text(t.y(), kDigits) + "\n";
  for (const auto& face : mesh.faces) {
    text += "f";
    for (const TexturedMesh::Corner& corner : face)
      text += " " + std::to_string(corner.vertex + 1) + "/" + std::to_string(corner.coordinate + 1);
    text += "\n";
  }
  return text;
}

std::string obj_material_text(const std::string& texture_file) {
  return std::string("newmtl ") + kMaterial + "\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " +
         texture_file + "\n";
}

}  // namespace organbake
