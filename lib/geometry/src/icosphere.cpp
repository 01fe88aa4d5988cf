// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/icosphere.h"

#include <cmath>
#include <unordered_map>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr int kMostSubdivisions = 9;

TriangleMesh icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (auto& vertex : mesh.vertices) vertex.normalize();
  mesh.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return mesh;
}

class Midpoints {
 public:
  explicit Midpoints(TriangleMesh& mesh) : mesh_(mesh) { known_.reserve(mesh.faces.size() * 2); }

  std::uint32_t of(std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto [entry, is_new] = known_.try_emplace(edge_key(a, b), next);
    if (is_new) mesh_.vertices.push_back((mesh_.vertices[a] + mesh_.vertices[b]).normalized());
    return entry->second;
  }

 private:
  TriangleMesh& mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> known_;
};

}  // namespace

TriangleMesh make_icosphere(int subdivisions) {
  if (subdivisions < 0 || subdivisions > kMostSubdivisions)
    throw UsageError("subdivisions = " + std::to_string(subdivisions) + ": take 0…9");
  TriangleMesh mesh = icosahedron();
  for (int level = 0; level < subdivisions; ++level) {
    Midpoints midpoints(mesh);
    std::vector<Face> finer;
    finer.reserve(mesh.faces.size() * 4);
    for (const auto& [a, b, c] : mesh.faces) {
      const auto ab = midpoints.of(a, b), bc = midpoints.of(b, c), ca = midpoints.of(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = std::move(finer);
  }
  return mesh;
}

}  // namespace organbake
