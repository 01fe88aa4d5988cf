// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/registered_surface.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

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

struct Edge {
  std::uint32_t low, high;
  bool operator==(const Edge&) const = default;
  auto operator<=>(const Edge&) const = default;
};

// Of welded vertices, once for each face that has it; sorted.
std::vector<Edge> edges_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& vertex) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.faces.size());
  for (const Face& face : mesh.faces)
    for (int i = 0; i < 3; ++i) {
      const auto a = vertex[face[i]], b = vertex[face[(i + 1) % 3]];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b)});
    }
  std::sort(edges.begin(), edges.end());
  return edges;
}

using Neighbors = std::vector<std::vector<std::uint32_t>>;

}  // namespace

std::vector<float> border_distance_mm(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> vertex = welded(mesh.vertices);
  const std::vector<Edge> edges = edges_of(mesh, vertex);
  constexpr float kFar = std::numeric_limits<float>::infinity();
  std::vector<float> distance(mesh.vertices.size(), kFar);
  Neighbors neighbors(mesh.vertices.size());
  using Reached = std::pair<float, std::uint32_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    const auto [a, b] = edges[i];
    neighbors[a].push_back(b);
    neighbors[b].push_back(a);
    if (end - i == 1)
      for (const std::uint32_t v : {a, b})
        if (distance[v] > 0) open.emplace(distance[v] = 0, v);
    i = end;
  }
  if (open.empty()) return {};
  while (!open.empty()) {
    const auto [reached, v] = open.top();
    open.pop();
    if (reached > distance[v]) continue;
    for (const std::uint32_t w : neighbors[v]) {
      const auto length = static_cast<float>((mesh.vertices[v] - mesh.vertices[w]).norm());
      if (reached + length < distance[w]) open.emplace(distance[w] = reached + length, w);
    }
  }
  for (std::size_t v = 0; v < vertex.size(); ++v) distance[v] = distance[vertex[v]];
  return distance;
}

}  // namespace organbake
