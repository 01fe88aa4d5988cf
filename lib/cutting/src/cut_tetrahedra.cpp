// SPDX-License-Identifier: Apache-2.0
// Tetrahedra copied along a sheet, by virtual nodes (Molino, Bao & Fedkiw 2004): an element that a
// cut passes is there once for each side, and nodes are shared by those that still hang together.
// How much of an element each side holds is told by pieces of it: a face is divided by its own
// edges alone, so that the two tetrahedra beside it agree without asking each other.
#include "organbake/cutting/cut_body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <utility>

#include "organbake/core/union_find.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// The corners of each face, seen from outside counter-clockwise; face k lies opposite to corner k.
constexpr std::array<std::array<int, 3>, 4> kFaces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
constexpr std::array<std::array<int, 2>, 6> kEdges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

// The number of the edge between two corners.
int edge_between(int a, int b) {
  if (a > b) std::swap(a, b);
  return a == 0 ? b - 1 : a + b;
}

// A tetrahedron in pieces, one for each of its corners, when some of its edges are cut. Two cut
// edges of a face cut off the corner between them along a line, three meet in the face's middle.
// From these lines walls lead to the mean of all cut places.
class TetrahedronPieces {
 public:
  TetrahedronPieces(const TetrahedralBody& body, const EdgeCrossings& edges,
                    std::uint32_t tetrahedron)
      : body_(body), nodes_(body.tetrahedra[tetrahedron].nodes) {
    UnionFind joined(4);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int cuts = 0;
    for (int e = 0; e < 6; ++e) {
      const auto [a, b] = kEdges[e];
      edge_[e] = edges.index_of(nodes_[a], nodes_[b]);
      cut_[e] = edges.cut(edge_[e]);
      if (!cut_[e]) {
        joined.join(std::uint32_t(a), std::uint32_t(b));
        continue;
      }
      const auto [first, second] = edges.edge(edge_[e]);
      const double share = edges[edge_[e]].share();
      place_[e] = (1 - share) * body.nodes_mm[first] + share * body.nodes_mm[second];
      sum += place_[e];
      ++cuts;
    }
    for (int k = 0; k < 4; ++k) groups_[k] = static_cast<int>(joined.root(std::uint32_t(k)));
    if (cuts > 0) middle_ = sum / cuts;
  }

  // Groups of corners that edges which are whole join; the lowest corner names each.
  const std::array<int, 4>& groups() const { return groups_; }
  bool falls_apart() const { return groups_ != std::array{0, 0, 0, 0}; }
  // Of one group's piece: its walls all lead to the middle, and count for nothing from there.
  double volume_mm3(int group) const {
    double six = 0;
    for (int corner = 0; corner < 4; ++corner) {
      if (groups_[corner] != group) continue;
      for (int face = 0; face < 4; ++face)
        for (const auto& [a, b, c] : face_piece(face, corner))
          six += (a - middle_).cross(b - middle_).dot(c - middle_);
    }
    return six / 6;
  }

 private:
  using Triangle = std::array<Eigen::Vector3d, 3>;

  const Eigen::Vector3d& node(int corner) const { return body_.nodes_mm[nodes_[corner]]; }
  bool cut(int a, int b) const { return cut_[edge_between(a, b)]; }
  const Eigen::Vector3d& cut_place(int a, int b) const { return place_[edge_between(a, b)]; }

  // Summed in an order that both who share the face have.
  Eigen::Vector3d face_middle(int face) const {
    const auto& [a, b, c] = kFaces[face];
    std::array<int, 3> own = {edge_between(a, b), edge_between(b, c), edge_between(c, a)};
    std::sort(own.begin(), own.end(), [&](int e, int f) { return edge_[e] < edge_[f]; });
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int e : own) middle += place_[e] / 3;
    return middle;
  }

  // What of a face belongs to one of its corners, outward; empty when the face does not reach it.
  std::vector<Triangle> face_piece(int face, int corner) const {
    const auto& f = kFaces[face];
    const auto at = std::find(f.begin(), f.end(), corner) - f.begin();
    if (at == 3) return {};
    const int a = corner, b = f[(at + 1) % 3], c = f[(at + 2) % 3];
    const int count = cut(a, b) + cut(b, c) + cut(c, a);
    if (count == 3) {
      const Eigen::Vector3d middle = face_middle(face);
      return {{node(a), cut_place(a, b), middle}, {node(a), middle, cut_place(a, c)}};
    }
    if (count < 2) {  // in one piece: the whole face is its lowest corner's
      if (corner != *std::min_element(f.begin(), f.end())) return {};
      // Others who meet the edge that is cut see its place.
      if (cut(b, c))
        return {{node(a), node(b), cut_place(b, c)}, {node(a), cut_place(b, c), node(c)}};
      if (cut(a, b))
        return {{node(c), node(a), cut_place(a, b)}, {node(c), cut_place(a, b), node(b)}};
      if (cut(c, a))
        return {{node(b), node(c), cut_place(c, a)}, {node(b), cut_place(c, a), node(a)}};
      return {{node(a), node(b), node(c)}};
    }
    if (cut(a, b) && cut(a, c)) return {{node(a), cut_place(a, b), cut_place(a, c)}};
    // The other two keep a quadrangle together; the one that comes first of them round it has all.
    if (cut(a, b)) return {};  // then b is cut off, and c comes before a
    return {{node(a), node(b), cut_place(b, c)}, {node(a), cut_place(b, c), cut_place(c, a)}};
  }

  const TetrahedralBody& body_;
  const std::array<std::uint32_t, 4>& nodes_;
  std::array<bool, 6> cut_{};
  std::array<std::uint32_t, 6> edge_{};
  std::array<Eigen::Vector3d, 6> place_;
  std::array<int, 4> groups_{};
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
};

using FaceKey = std::array<std::uint32_t, 3>;

FaceKey key_of(const Tetrahedron& t, int face) {
  FaceKey key;
  for (int k = 0; k < 3; ++k) key[k] = t.nodes[kFaces[face][k]];
  std::sort(key.begin(), key.end());
  return key;
}

int corner_of(const Tetrahedron& t, std::uint32_t node) {
  return static_cast<int>(std::find(t.nodes.begin(), t.nodes.end(), node) - t.nodes.begin());
}

}  // namespace

std::vector<EdgeCrossings::Edge> edges_of(const std::vector<Tetrahedron>& tetrahedra) {
  std::vector<EdgeCrossings::Edge> edges;
  edges.reserve(6 * tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra)
    for (const auto& [a, b] : kEdges) edges.push_back({t.nodes[a], t.nodes[b]});
  return edges;
}

CutTetrahedra::CutTetrahedra(const TetrahedralBody& body, const EdgeCrossings& edges) {
  make_copies(body, edges);
  join_nodes(body);
  drop_doubles();
  number_fragments();
}

void CutTetrahedra::make_copies(const TetrahedralBody& body, const EdgeCrossings& edges) {
  const std::vector<std::uint8_t> beside_cuts = edges.beside_cuts();
  for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t) {
    first_.push_back(static_cast<std::uint32_t>(copies_.size()));
    const auto& nodes = body.tetrahedra[t].nodes;
    if (std::none_of(nodes.begin(), nodes.end(), [&](auto n) { return beside_cuts[n] != 0; })) {
      copies_.push_back({t, 0b1111, nodes, 1});
      continue;
    }
    const TetrahedronPieces pieces(body, edges, t);
    if (!pieces.falls_apart()) {
      copies_.push_back({t, 0b1111, body.tetrahedra[t].nodes, 1});
      continue;
    }
    const double whole = volume_of(body, body.tetrahedra[t]);
    for (int group = 0; group < 4; ++group) {
      Copy copy{t, 0, body.tetrahedra[t].nodes, 0};
      for (int k = 0; k < 4; ++k) {
        if (pieces.groups()[k] == group) copy.corners |= static_cast<std::uint8_t>(1u << k);
      }
      if (copy.corners == 0) continue;
      copy.share = pieces.volume_mm3(group) / whole;
      copies_.push_back(copy);
    }
  }
  first_.push_back(static_cast<std::uint32_t>(copies_.size()));
}

// A corner whose tissue a copy holds is the body's own node. Others are copies of it, one for all
// that meet through faces on which they hold the same tissue.
void CutTetrahedra::join_nodes(const TetrahedralBody& body) {
  const auto nodes = static_cast<std::uint32_t>(body.nodes_mm.size());
  UnionFind joined(nodes + 4 * copies_.size());
  const auto place = [&](std::uint32_t copy, int corner) {
    return nodes + 4 * copy + static_cast<std::uint32_t>(corner);
  };
  for (std::uint32_t c = 0; c < copies_.size(); ++c) {
    for (int k = 0; k < 4; ++k) {
      if (copies_[c].corners >> k & 1)
        joined.join(body.tetrahedra[copies_[c].tetrahedron].nodes[k], place(c, k));
    }
  }
  std::map<FaceKey, std::vector<std::uint32_t>> sharing;  // of split tetrahedra's faces
  std::vector<std::uint8_t> of_split(nodes, 0);           // their nodes: few of all
  for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t) {
    if (!split(t)) continue;
    for (int face = 0; face < 4; ++face) sharing[key_of(body.tetrahedra[t], face)];
    for (const std::uint32_t n : body.tetrahedra[t].nodes) of_split[n] = 1;
  }
  for (std::uint32_t t = 0; !sharing.empty() && t < body.tetrahedra.size(); ++t) {
    const auto& own = body.tetrahedra[t].nodes;
    if (std::count_if(own.begin(), own.end(), [&](auto n) { return of_split[n] != 0; }) < 3)
      continue;
    for (int face = 0; face < 4; ++face) {
      const auto found = sharing.find(key_of(body.tetrahedra[t], face));
      if (found != sharing.end()) found->second.push_back(t);
    }
  }
  for (const auto& [key, both] : sharing) {
    if (both.size() != 2) continue;
    const Tetrahedron &one = body.tetrahedra[both[0]], &other = body.tetrahedra[both[1]];
    for (std::uint32_t c = first_copy(both[0]); c < end_copy(both[0]); ++c) {
      for (std::uint32_t d = first_copy(both[1]); d < end_copy(both[1]); ++d) {
        const bool meet = std::any_of(key.begin(), key.end(), [&](std::uint32_t n) {
          return (copies_[c].corners >> corner_of(one, n) & 1) &&
                 (copies_[d].corners >> corner_of(other, n) & 1);
        });
        if (!meet) continue;
        for (const std::uint32_t n : key)
          joined.join(place(c, corner_of(one, n)), place(d, corner_of(other, n)));
      }
    }
  }
  for (std::uint32_t n = 0; n < nodes; ++n) original_.push_back(n);
  std::vector<std::uint32_t> number(4 * copies_.size(), kNone);
  for (std::uint32_t c = 0; c < copies_.size(); ++c) {
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t root = joined.root(place(c, k));
      if (root < nodes) {
        copies_[c].nodes[k] = root;
        continue;
      }
      std::uint32_t& own = number[root - nodes];
      if (own == kNone) {
        own = static_cast<std::uint32_t>(original_.size());
        original_.push_back(body.tetrahedra[copies_[c].tetrahedron].nodes[k]);
      }
      copies_[c].nodes[k] = own;
    }
  }
}

// Copies of one tetrahedron that share all their nodes are one: the tissue holds together there.
void CutTetrahedra::drop_doubles() {
  std::vector<Copy> kept;
  std::vector<std::uint32_t> first;
  for (std::uint32_t t = 0; t + 1 < first_.size(); ++t) {
    first.push_back(static_cast<std::uint32_t>(kept.size()));
    for (std::uint32_t c = first_[t]; c < first_[t + 1]; ++c) {
      const auto same = std::find_if(kept.begin() + first.back(), kept.end(),
                                     [&](const Copy& k) { return k.nodes == copies_[c].nodes; });
      if (same == kept.end()) {
        kept.push_back(copies_[c]);
      } else {
        same->corners |= copies_[c].corners;
        same->share += copies_[c].share;
      }
    }
  }
  first.push_back(static_cast<std::uint32_t>(kept.size()));
  copies_ = std::move(kept);
  first_ = std::move(first);
}

void CutTetrahedra::number_fragments() {
  UnionFind joined(original_.size());
  for (const Copy& copy : copies_)
    for (int k = 1; k < 4; ++k) joined.join(copy.nodes[0], copy.nodes[k]);
  std::vector<std::uint32_t> number(original_.size(), kNone);
  for (const Copy& copy : copies_) {
    std::uint32_t& own = number[joined.root(copy.nodes[0])];
    if (own == kNone) own = fragment_count_++;
    fragment_.push_back(own);
  }
}

std::uint32_t CutTetrahedra::copy_at(const TetrahedronCorner& at) const {
  std::uint32_t copy = first_copy(at.tetrahedron);
  while (!(copies_[copy].corners >> at.corner & 1)) ++copy;
  return copy;
}

TetrahedronCorner CutTetrahedra::held_corner(std::uint32_t copy) const {
  return {copies_[copy].tetrahedron, std::countr_zero(copies_[copy].corners)};
}

bool CutTetrahedra::same_as(const CutTetrahedra& other) const {
  return std::equal(copies_.begin(), copies_.end(), other.copies_.begin(), other.copies_.end(),
                    [](const Copy& a, const Copy& b) {
                      return a.tetrahedron == b.tetrahedron && a.corners == b.corners &&
                             a.nodes == b.nodes;
                    });
}

}  // namespace organbake
