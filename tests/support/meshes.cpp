// SPDX-License-Identifier: Apache-2.0
#include "support/meshes.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace organbake {
namespace {

TriangleMesh icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh m;
  m.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  m.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
             {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
             {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (auto& v : m.vertices) v.normalize();
  return m;
}

TriangleMesh subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine;
  fine.vertices = mesh.vertices;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, inserted] = middles.try_emplace(std::minmax(a, b), fine.vertices.size());
    if (inserted) fine.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
    return found->second;
  };
  for (const auto& [a, b, c] : mesh.faces) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Face& f : {Face{a, ab, ca}, Face{b, bc, ab}, Face{c, ca, bc}, Face{ab, bc, ca}}) {
      fine.faces.push_back(f);
    }
  }
  return fine;
}

}  // namespace

TriangleMesh tetrahedron_mesh() {
  TriangleMesh m;
  m.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  m.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return m;
}

TriangleMesh box_mesh(const Eigen::Vector3d& size_mm) {
  TriangleMesh m;
  for (int i = 0; i < 8; ++i) {
    m.vertices.push_back(size_mm.cwiseProduct(Eigen::Vector3d(i & 1, i >> 1 & 1, i >> 2)));
  }
  m.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
             {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return m;
}

TriangleMesh sphere_mesh(double radius_mm, int subdivisions) {
  TriangleMesh m = icosahedron();
  for (int i = 0; i < subdivisions; ++i) m = subdivided(m);
  for (auto& v : m.vertices) v *= radius_mm;
  return m;
}

TriangleMesh lumpy_mesh(double radius_mm, int subdivisions) {
  TriangleMesh m = sphere_mesh(1, subdivisions);
  for (auto& v : m.vertices) {
    v *= radius_mm * (1 + 0.2 * v.x() + 0.15 * v.y() * v.z() + 0.1 * std::sin(3 * v.y() + v.x()) +
                      0.12 * v.z() * v.z() * v.z());
  }
  return m;
}

}  // namespace organbake
