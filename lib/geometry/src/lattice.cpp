// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/lattice.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

std::array<std::uint32_t, 2> ordered(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

// Nodes in order: the vertices, then each edge's, then each face's inner ones.
Lattice::Lattice(const TriangleMesh& proxy, std::uint32_t steps)
    : proxy_(proxy), steps_(steps), face_count_(static_cast<std::uint32_t>(proxy.faces.size())) {
  for (const auto& [a, b, c] : proxy.faces)
    edges_.insert(edges_.end(), {ordered(a, b), ordered(b, c), ordered(c, a)});
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  const auto edge_index = [&](std::uint32_t a, std::uint32_t b) {
    const auto at = std::lower_bound(edges_.begin(), edges_.end(), ordered(a, b));
    return static_cast<std::uint32_t>(at - edges_.begin());
  };
  for (const auto& [a, b, c] : proxy.faces)
    face_edges_.push_back({edge_index(a, b), edge_index(b, c), edge_index(c, a)});
  first_inner_ = static_cast<std::uint32_t>(proxy.vertices.size() + edges_.size() * (steps_ - 1));
}

// from_first: steps away from the face's own first corner of that edge, 1 … steps − 1.
std::uint32_t Lattice::on_edge(std::uint32_t face, int edge, std::uint32_t from_first) const {
  const std::uint32_t index = face_edges_[face][edge];
  const bool same_way = proxy_.faces[face][edge] == edges_[index][0];
  const std::uint32_t from_lower = same_way ? from_first : steps_ - from_first;
  return static_cast<std::uint32_t>(proxy_.vertices.size()) + index * (steps_ - 1) + from_lower - 1;
}

std::uint32_t Lattice::node(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
  const std::uint32_t k = steps_ - i - j;  // b0
  const Face& corners = proxy_.faces[face];
  if (k == steps_) return corners[0];
  if (i == steps_) return corners[1];
  if (j == steps_) return corners[2];
  if (j == 0) return on_edge(face, 0, i);
  if (k == 0) return on_edge(face, 1, j);
  if (i == 0) return on_edge(face, 2, k);
  // Inner rows i = 1 … steps − 2 hold steps − 1 − i nodes each.
  const std::uint32_t before = (i - 1) * (steps_ - 1) - (i - 1) * i / 2;
  return first_inner_ + face * inner_per_face() + before + j - 1;
}

std::vector<Lattice::ShellLine> Lattice::shell_lines() const {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy_);
  std::vector<ShellLine> lines;
  lines.reserve(node_count());
  for (std::size_t v = 0; v < proxy_.vertices.size(); ++v)
    lines.push_back({proxy_.vertices[v], normals[v]});
  for (const auto& [a, b] : edges_)
    for (std::uint32_t s = 1; s < steps_; ++s) {
      const double share = double(s) / steps_;
      lines.push_back({(1 - share) * proxy_.vertices[a] + share * proxy_.vertices[b],
                       (1 - share) * normals[a] + share * normals[b]});
    }
  for (const auto& [a, b, c] : proxy_.faces)
    for (std::uint32_t i = 1; i + 1 < steps_; ++i)
      for (std::uint32_t j = 1; i + j < steps_; ++j) {
        const double b1 = double(i) / steps_, b2 = double(j) / steps_, b0 = 1 - b1 - b2;
        lines.push_back(
            {b0 * proxy_.vertices[a] + b1 * proxy_.vertices[b] + b2 * proxy_.vertices[c],
             b0 * normals[a] + b1 * normals[b] + b2 * normals[c]});
      }
  return lines;
}

std::uint32_t lattice_steps(const TriangleMesh& proxy, double step_mm, std::size_t max_nodes) {
  constexpr double kMostSteps = 64;
  const double wanted = std::round(mean_edge_length(proxy) / step_mm);
  auto steps = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, kMostSteps));
  while (steps > 1 && proxy.faces.size() * ((steps + 1) * (steps + 2) / 2) > max_nodes) --steps;
  return steps;
}

}  // namespace organbake
