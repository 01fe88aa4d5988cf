// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <utility>

#include "edge_bisection.h"
#include "organbake/cutting/cut_body.h"
#include "sheet_neighbourhood.h"

namespace organbake {
namespace {

// Edges that are cut open in steps of their length; shorter ones cost more than they show.
constexpr double kFineBody_mm = 3;
constexpr std::size_t kMostTetrahedra = 40'000;  // a step takes too long beyond
constexpr std::uint32_t kRankOfBodyMiddles = 0x8000'0000;

}  // namespace

// Those tetrahedra are halved that a sheet passes through, or next to.
bool CutBody::refine(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  part_of_.resize(body_.tetrahedra.size());
  std::iota(part_of_.begin(), part_of_.end(), 0u);
  const SheetNeighbourhood near(grid_, triangles.subspan(first_new));
  if (near.empty()) return false;
  Bisection halved = bisect(body_, [&](std::uint32_t t) {
    const Tetrahedron& tetrahedron = body_.tetrahedra[t];
    std::array<Eigen::Vector3d, 4> corners;
    for (int k = 0; k < 4; ++k) corners[k] = body_.nodes_mm[tetrahedron.nodes[k]];
    return body_.tetrahedra.size() < kMostTetrahedra && near.meets(corners) &&
           longest_edge_mm(body_, tetrahedron) > kFineBody_mm;
  });
  if (halved.none()) return false;
  part_of_ = std::move(halved.part_of);
  edges_ = edges_.finer(body_.nodes_mm, grid_, kRankOfBodyMiddles, edges_of(body_.tetrahedra),
                        triangles.first(first_new));
  measure();
  std::vector<std::vector<std::uint32_t>> near_barriers(body_.tetrahedra.size());
  for (std::uint32_t t = 0; t < near_barriers.size(); ++t) {
    for (const std::uint32_t b : near_barriers_[part_of_[t]])
      if (boxes_[t].meets(barriers_[b].box)) near_barriers[t].push_back(b);
  }
  near_barriers_ = std::move(near_barriers);
  return true;
}

std::vector<NodeSource> CutBody::sources(const CutBody& before) const {
  std::vector<NodeSource> sources(cut_.node_count());
  std::vector<std::uint8_t> known(sources.size(), 0);
  for (std::uint32_t n = 0; n < first_nodes_; ++n) sources[n] = {{n, n, n, n}, {1, 0, 0, 0}};
  for (std::uint32_t c = 0; c < cut_.copies().size(); ++c) {
    const CutTetrahedra::Copy& copy = cut_.copies()[c];
    const std::uint32_t part_of = part_of_[copy.tetrahedron];
    const int held = cut_.held_corner(c).corner;
    const std::uint32_t node = body_.tetrahedra[copy.tetrahedron].nodes[held];
    const auto& nodes = before.body_.tetrahedra[part_of].nodes;
    const auto corner = std::find(nodes.begin(), nodes.end(), node);
    const std::uint32_t was =
        corner != nodes.end()
            ? before.cut_.copy_at({part_of, static_cast<int>(corner - nodes.begin())})
            : before.copy_of(part_of, body_.nodes_mm[node]).copy;
    for (int k = 0; k < 4; ++k) {
      if (std::exchange(known[copy.nodes[k]], 1)) continue;
      sources[copy.nodes[k]] = before.place_of(part_of, body_.tetrahedra[copy.tetrahedron].nodes[k],
                                               body_.nodes_mm, was);
    }
  }
  return sources;
}

// A node of the body, or the middle of an edge of it, by the nodes of a tetrahedron's copy.
NodeSource CutBody::place_of(std::uint32_t tetrahedron, std::uint32_t node,
                             const std::vector<Eigen::Vector3d>& nodes_mm,
                             std::uint32_t copy) const {
  const auto& own = body_.tetrahedra[tetrahedron].nodes;
  NodeSource source{cut_.copies()[copy].nodes, {}};
  const auto corner = std::find(own.begin(), own.end(), node);
  if (corner == own.end()) {
    source.weights = weights_in(tetrahedron, nodes_mm[node]);
  } else {
    source.weights[static_cast<std::size_t>(corner - own.begin())] = 1;
  }
  return source;
}

}  // namespace organbake
