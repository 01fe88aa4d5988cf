// SPDX-License-Identifier: Apache-2.0
#include "cutting/edge_bisection.h"

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

LongEdge longest_edge(const TetrahedralBody& body, const Tetrahedron& tetrahedron) {
  LongEdge longest{-1, 0, 0};
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < a; ++b) {
      const auto [low, high] = std::minmax(tetrahedron.nodes[a], tetrahedron.nodes[b]);
      const LongEdge edge{(body.nodes_mm[high] - body.nodes_mm[low]).squaredNorm(), low, high};
      longest = std::max(longest, edge);
    }
  }
  return longest;
}

class Bisector {
 public:
  explicit Bisector(TetrahedralBody& body) : body_(body), round_(body.nodes_mm.size()) {
    for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t)
      for (const std::uint32_t n : body.tetrahedra[t].nodes) round_[n].push_back(t);
    anchored_.resize(body.nodes_mm.size(), 0);
    for (const std::uint32_t n : body.anchors) anchored_[n] = 1;
    result_.part_of.resize(body.tetrahedra.size());
    std::iota(result_.part_of.begin(), result_.part_of.end(), 0u);
  }

  Bisection run(const std::function<bool(std::uint32_t)>& is_coarse) {
    for (std::uint32_t t = 0; t < body_.tetrahedra.size(); ++t)
      while (is_coarse(t)) halve(t);
    if (!result_.none()) body_.vertices.clear();
    return std::move(result_);
  }

 private:
  // Those round an edge, increasing.
  std::vector<std::uint32_t> round(const LongEdge& edge) const {
    std::vector<std::uint32_t> both;
    for (const std::uint32_t t : round_[edge.low]) {
      const auto& nodes = body_.tetrahedra[t].nodes;
      if (std::find(nodes.begin(), nodes.end(), edge.high) != nodes.end()) both.push_back(t);
    }
    std::sort(both.begin(), both.end());
    return both;
  }

  void halve(std::uint32_t tetrahedron) {
    const LongEdge own = longest_edge(body_, body_.tetrahedra[tetrahedron]);
    const std::vector<std::uint32_t> both = round(own);
    for (const std::uint32_t t : both) {
      // Its longest edge is longer than this one: that goes on until there is none.
      if (longest_edge(body_, body_.tetrahedra[t]).length2_mm2 > kLonger * own.length2_mm2)
        return halve(t);
    }
    split(own, both);
  }

  void split(const LongEdge& edge, const std::vector<std::uint32_t>& both) {
    const auto middle = static_cast<std::uint32_t>(body_.nodes_mm.size());
    body_.nodes_mm.emplace_back(0.5 * (body_.nodes_mm[edge.low] + body_.nodes_mm[edge.high]));
    result_.halved.push_back({edge.low, edge.high});
    round_.emplace_back();
    anchored_.push_back(anchored_[edge.low] & anchored_[edge.high]);
    if (anchored_.back()) body_.anchors.push_back(middle);
    for (const std::uint32_t t : both) {
      const auto other = static_cast<std::uint32_t>(body_.tetrahedra.size());
      Tetrahedron half = body_.tetrahedra[t];
      std::replace(half.nodes.begin(), half.nodes.end(), edge.low, middle);
      auto& kept = body_.tetrahedra[t].nodes;
      std::replace(kept.begin(), kept.end(), edge.high, middle);
      std::erase(round_[edge.high], t);
      round_[middle].push_back(t);
      for (const std::uint32_t n : half.nodes) round_[n].push_back(other);
      body_.tetrahedra.push_back(half);
      result_.part_of.push_back(result_.part_of[t]);
    }
  }

  TetrahedralBody& body_;
  std::vector<std::vector<std::uint32_t>> round_;  // tetrahedra, by node
  std::vector<std::uint8_t> anchored_;             // by node
  Bisection result_;
};

}  // namespace

double longest_edge_mm(const TetrahedralBody& body, const Tetrahedron& tetrahedron) {
  return std::sqrt(longest_edge(body, tetrahedron).length2_mm2);
}

Bisection bisect(TetrahedralBody& body, const std::function<bool(std::uint32_t)>& is_coarse) {
  return Bisector(body).run(is_coarse);
}

}  // namespace organbake
