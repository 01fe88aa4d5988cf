// SPDX-License-Identifier: GPL-3.0-or-later
#include "tissue_layer.h"

#include <Eigen/Geometry>
#include <cstdlib>
#include <span>
#include <utility>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

// Of the faces' areas; those of a closed surface sum up to nothing, of half a sphere to a half.
constexpr double kLeastOneWay = 0.4;

// Twice the faces' areas, as vectors along their normals.
Eigen::Vector3d sum_of_areas(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [a, b, c] : mesh.faces)
    sum += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
  return sum;
}

}  // namespace

bool is_sheet(const TriangleMesh& surface) {
  return sum_of_areas(surface).norm() > kLeastOneWay * 2 * surface_area(surface);
}

TriangleMesh tissue_layer(const TriangleMesh& sheet, double thickness_mm) {
  const auto below = static_cast<std::uint32_t>(sheet.vertices.size());
  const Eigen::Vector3d down = -thickness_mm * sum_of_areas(sheet).normalized();
  TriangleMesh layer{sheet.vertices, sheet.faces, {}};
  for (const Eigen::Vector3d& v : sheet.vertices) layer.vertices.push_back(v + down);
  for (const Face& f : sheet.faces)
    layer.faces.push_back({below + f[0], below + f[2], below + f[1]});
  MeshEdges(sheet).for_each([&](std::span<const EdgeUse> uses) {
    int up = 0;
    for (const EdgeUse& use : uses) up += use.up() ? 1 : -1;
    // As often as the sheet runs along it more one way than back.
    const auto [a, b] =
        up > 0 ? std::pair(uses[0].low, uses[0].high) : std::pair(uses[0].high, uses[0].low);
    for (int i = 0; i < std::abs(up); ++i) {
      layer.faces.push_back({b, a, below + a});
      layer.faces.push_back({b, below + a, below + b});
    }
  });
  return layer;
}

}  // namespace organbake
