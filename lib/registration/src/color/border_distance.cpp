// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/registration/registered_surface.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

// The lowest vertex at the same place, for each vertex.
std::vector<std::uint32_t> welded(const std::vector<Eigen::Vector3d>& vertices) {
  std::vector<std::uint32_t> order(vertices.size()), first(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const auto &p = vertices[a], &q = vertices[b];
    return std::tie(p.x(), p.y(), p.z(), a) < std::tie(q.x(), q.y(), q.z(), b);
  };
  std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && vertices[order[i]] == vertices[order[i - 1]];
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

}  // namespace

std::vector<float> border_distance_mm(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> vertex = welded(mesh.vertices);
  std::vector<Face> faces = mesh.faces;
  for (Face& face : faces)
    for (std::uint32_t& v : face) v = vertex[v];
  constexpr float kFar = std::numeric_limits<float>::infinity();
  std::vector<float> distance(mesh.vertices.size(), kFar);
  using Reached = std::pair<float, std::uint32_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  MeshEdges(faces, vertex.size()).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() > 1) return;
    for (const std::uint32_t v : {uses[0].low, uses[0].high})
      if (distance[v] > 0) open.emplace(distance[v] = 0, v);
  });
  if (open.empty()) return {};
  const VertexNeighbours neighbours(faces, vertex.size());
  while (!open.empty()) {
    const auto [reached, v] = open.top();
    open.pop();
    if (reached > distance[v]) continue;
    for (const std::uint32_t w : neighbours.of(v)) {
      const auto length = static_cast<float>((mesh.vertices[v] - mesh.vertices[w]).norm());
      if (reached + length < distance[w]) open.emplace(distance[w] = reached + length, w);
    }
  }
  for (std::size_t v = 0; v < vertex.size(); ++v) distance[v] = distance[vertex[v]];
  return distance;
}

}  // namespace organbake
