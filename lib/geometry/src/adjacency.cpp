// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/adjacency.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace organbake {

VertexFaces::VertexFaces(const std::vector<Face>& faces, std::size_t vertex_count)
    : first_(vertex_count + 1, 0), faces_(3 * faces.size()) {
  for (const Face& face : faces) {
    for (const std::uint32_t vertex : face) ++first_[vertex + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t vertex : faces[f]) faces_[next[vertex]++] = f;
  }
}

VertexNeighbours::VertexNeighbours(const std::vector<Face>& faces, std::size_t vertex_count)
    : first_(vertex_count + 1, 0) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;  // both ways
  edges.reserve(6 * faces.size());
  for (const Face& f : faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k], b = f[(k + 1) % 3];
      if (a == b) continue;
      edges.emplace_back(a, b);
      edges.emplace_back(b, a);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  neighbours_.reserve(edges.size());
  for (const auto& [from, to] : edges) {
    ++first_[from + 1];
    neighbours_.push_back(to);
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
}

}  // namespace organbake
