// SPDX-License-Identifier: GPL-3.0-or-later
#include "mechanics/tissue_layer.h"

#include <Eigen/Geometry>
#include <map>
#include <utility>

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
  std::map<std::pair<std::uint32_t, std::uint32_t>, int>
      left_over;  // by how often more one way than back
  for (const Eigen::Vector3d& v : sheet.vertices) layer.vertices.push_back(v + down);
  for (const Face& f : sheet.faces) {
    layer.faces.push_back({below + f[0], below + f[2], below + f[1]});
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k], b = f[(k + 1) % 3];
      ++left_over[{a, b}], --left_over[{b, a}];
    }
  }
  for (const auto& [edge, times] : left_over) {
    const auto& [a, b] = edge;
    for (int i = 0; i < times; ++i) {
      layer.faces.push_back({b, a, below + a});
      layer.faces.push_back({b, below + a, below + b});
    }
  }
  return layer;
}

}  // namespace organbake
