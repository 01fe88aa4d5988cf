// SPDX-License-Identifier: Apache-2.0
#include "edge_bisection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace organbake {
namespace {

// Squared lengths that differ by less are equal: along a lattice's rows all longest edges are, and
// to halve the last of them first would halve them all.
constexpr double kLonger = 1.000001;

// By length, then by its nodes: no two edges are equal, and who asks finds the same one longest.
struct LongEdge {
  double length2_mm2;
  std::uint32_t low, high;

  bool operator<(const LongEdge& other) const {
    return std::tie(length2_mm2, low, high) < std::tie(other.length2_mm2, other.low, other.high);
  }
};

Face& corners(Face& face) { return face; }
const Face& corners(const Face& face) { return face; }
auto& corners(Tetrahedron& tetrahedron) { return tetrahedron.nodes; }
const auto& corners(const Tetrahedron& tetrahedron) { return tetrahedron.nodes; }

template <class Cell>
LongEdge longest_edge(const std::vector<Eigen::Vector3d>& nodes_mm, const Cell& cell) {
  const auto& own = corners(cell);
  LongEdge longest{-1, 0, 0};
  for (std::size_t a = 0; a < own.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const auto [low, high] = std::minmax(own[a], own[b]);
      const LongEdge edge{(nodes_mm[high] - nodes_mm[low]).squaredNorm(), low, high};
      longest = std::max(longest, edge);
    }
  }
  return longest;
}

template <class Cell>
class Bisector {
 public:
  Bisector(std::vector<Eigen::Vector3d>& nodes_mm, std::vector<Cell>& cells)
      : nodes_mm_(nodes_mm), cells_(cells), round_(nodes_mm.size()) {
    for (std::uint32_t c = 0; c < cells.size(); ++c)
      for (const std::uint32_t n : corners(cells[c])) round_[n].push_back(c);
    result_.part_of.resize(cells.size());
    std::iota(result_.part_of.begin(), result_.part_of.end(), 0u);
  }

  Bisection run(const std::function<bool(std::uint32_t)>& is_coarse) {
    for (std::uint32_t c = 0; c < cells_.size(); ++c)
      while (is_coarse(c)) halve(c);
    return std::move(result_);
  }

 private:
  // Those round an edge, increasing.
  std::vector<std::uint32_t> round(const LongEdge& edge) const {
    std::vector<std::uint32_t> both;
    for (const std::uint32_t c : round_[edge.low]) {
      const auto& own = corners(cells_[c]);
      if (std::find(own.begin(), own.end(), edge.high) != own.end()) both.push_back(c);
    }
    std::sort(both.begin(), both.end());
    return both;
  }

  void halve(std::uint32_t cell) {
    const LongEdge own = longest_edge(nodes_mm_, cells_[cell]);
    const std::vector<std::uint32_t> both = round(own);
    for (const std::uint32_t c : both) {
      // Its longest edge is longer than this one: that goes on until there is none.
      if (longest_edge(nodes_mm_, cells_[c]).length2_mm2 > kLonger * own.length2_mm2)
        return halve(c);
    }
    split(own, both);
  }

  void split(const LongEdge& edge, const std::vector<std::uint32_t>& both) {
    const auto middle = static_cast<std::uint32_t>(nodes_mm_.size());
    nodes_mm_.emplace_back(0.5 * (nodes_mm_[edge.low] + nodes_mm_[edge.high]));
    result_.halved.push_back({edge.low, edge.high});
    round_.emplace_back();
    for (const std::uint32_t c : both) {
      const auto other = static_cast<std::uint32_t>(cells_.size());
      Cell half = cells_[c];
      auto &kept = corners(cells_[c]), &split_off = corners(half);
      std::replace(split_off.begin(), split_off.end(), edge.low, middle);
      std::replace(kept.begin(), kept.end(), edge.high, middle);
      std::erase(round_[edge.high], c);
      round_[middle].push_back(c);
      for (const std::uint32_t n : split_off) round_[n].push_back(other);
      cells_.push_back(half);
      result_.part_of.push_back(result_.part_of[c]);
    }
  }

  std::vector<Eigen::Vector3d>& nodes_mm_;
  std::vector<Cell>& cells_;
  std::vector<std::vector<std::uint32_t>> round_;  // cells, by node
  Bisection result_;
};

}  // namespace

double longest_edge_mm(const TriangleMesh& mesh, const Face& face) {
  return std::sqrt(longest_edge(mesh.vertices, face).length2_mm2);
}

double longest_edge_mm(const TetrahedralBody& body, const Tetrahedron& tetrahedron) {
  return std::sqrt(longest_edge(body.nodes_mm, tetrahedron).length2_mm2);
}

Bisection bisect(TriangleMesh& mesh, const std::function<bool(std::uint32_t)>& is_coarse) {
  return Bisector(mesh.vertices, mesh.faces).run(is_coarse);
}

Bisection bisect(TetrahedralBody& body, const std::function<bool(std::uint32_t)>& is_coarse) {
  std::vector<std::uint8_t> anchored(body.nodes_mm.size(), 0);
  for (const std::uint32_t n : body.anchors) anchored[n] = 1;
  const std::size_t first_new = body.nodes_mm.size();
  Bisection result = Bisector(body.nodes_mm, body.tetrahedra).run(is_coarse);
  for (std::size_t i = 0; i < result.halved.size(); ++i) {
    const auto [a, b] = result.halved[i];
    anchored.push_back(anchored[a] & anchored[b]);
    if (anchored.back()) body.anchors.push_back(static_cast<std::uint32_t>(first_new + i));
  }
  if (!result.none()) body.vertices.clear(), body.patches.clear();
  return result;
}

}  // namespace organbake
