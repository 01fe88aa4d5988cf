// SPDX-License-Identifier: Apache-2.0
// A mesh's size and its parts, and what is left of it without some.
#include "organbake/geometry/triangle_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

Eigen::Vector3d scaled_normal(const TriangleMesh& mesh, const Face& f) {
  const Eigen::Vector3d& a = mesh.vertices[f[0]];
  return (mesh.vertices[f[1]] - a).cross(mesh.vertices[f[2]] - a);
}

}  // namespace

Bounds bounds(const TriangleMesh& mesh) {
  Bounds box;
  for (const auto& v : mesh.vertices) box.add(v);
  return box;
}

Eigen::Vector3d face_normal(const TriangleMesh& mesh, std::size_t face) {
  const Eigen::Vector3d n = scaled_normal(mesh, mesh.faces[face]);
  const double length = n.norm();
  return length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d::Zero();
}

std::array<Eigen::Vector3d, 3> corner_normals(const TriangleMesh& mesh, std::size_t face) {
  const Eigen::Vector3d normal = face_normal(mesh, face);
  std::array<Eigen::Vector3d, 3> weighted;
  for (int corner = 0; corner < 3; ++corner) {
    const Face& f = mesh.faces[face];
    const Eigen::Vector3d& at = mesh.vertices[f[corner]];
    const Eigen::Vector3d to_next = mesh.vertices[f[(corner + 1) % 3]] - at;
    const Eigen::Vector3d to_last = mesh.vertices[f[(corner + 2) % 3]] - at;
    weighted[corner] = std::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last)) * normal;
  }
  return weighted;
}

double face_area(const TriangleMesh& mesh, std::size_t face) {
  return 0.5 * scaled_normal(mesh, mesh.faces[face]).norm();
}

double mean_edge_length(const TriangleMesh& mesh) {
  if (mesh.faces.empty()) return 0;
  double sum = 0;
  for (const Face& f : mesh.faces)
    for (int k = 0; k < 3; ++k) sum += (mesh.vertices[f[k]] - mesh.vertices[f[(k + 1) % 3]]).norm();
  return sum / (3 * static_cast<double>(mesh.faces.size()));
}

double signed_volume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  // About the first vertex, so that a mesh far from the origin loses no digits.
  const Eigen::Vector3d origin = mesh.vertices.front();
  double six_volumes = 0;
  for (const Face& f : mesh.faces)
    six_volumes += (mesh.vertices[f[0]] - origin)
                       .dot((mesh.vertices[f[1]] - origin).cross(mesh.vertices[f[2]] - origin));
  return six_volumes / 6;
}

double surface_area(const TriangleMesh& mesh) {
  double area = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) area += face_area(mesh, f);
  return area;
}

std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  // Block by block: the angles, which take long, side by side, then their sums in the faces' order.
  constexpr std::size_t kBlock = 1 << 14, kGrain = 1 << 10;
  std::vector<std::array<Eigen::Vector3d, 3>> parts(std::min(kBlock, mesh.faces.size()));
  for (std::size_t begin = 0; begin < mesh.faces.size(); begin += kBlock) {
    const std::size_t end = std::min(mesh.faces.size(), begin + kBlock);
    parallel_pieces(begin, end, kGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t f = first; f < last; ++f) parts[f - begin] = corner_normals(mesh, f);
    });
    for (std::size_t f = begin; f < end; ++f)
      for (int corner = 0; corner < 3; ++corner)
        normals[mesh.faces[f][corner]] += parts[f - begin][corner];
  }
  for (auto& n : normals) {
    const double length = n.norm();
    n = length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d::UnitZ();
  }
  return normals;
}

}  // namespace organbake
