// SPDX-License-Identifier: Apache-2.0
// Tetrahedra copied along a sheet, by virtual nodes (Molino, Bao & Fedkiw 2004): an element that a
// cut passes is there once for each side, and nodes are shared by those that still hang together.
#include "organbake/cutting/cut_body.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "organbake/core/union_find.h"
#include "tetrahedron_pieces.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

using FaceKey = std::array<std::uint32_t, 3>;

FaceKey key_of(const Tetrahedron& t, int face) {
  FaceKey key;
  for (int k = 0; k < 3; ++k) key[k] = t.nodes[kTetrahedronFaces[face][k]];
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
    for (const auto& [a, b] : kTetrahedronEdges) edges.push_back({t.nodes[a], t.nodes[b]});
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

std::vector<double> CutTetrahedra::fragment_volumes(const TetrahedralBody& body) const {
  std::vector<double> volumes(fragment_count_, 0.0);
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    const Copy& copy = copies_[c];
    volumes[fragment_[c]] += copy.share * volume_of(body, body.tetrahedra[copy.tetrahedron]);
  }
  return volumes;
}

std::vector<TriangleMesh> fragment_surfaces(const TetrahedralBody& body, const EdgeCrossings& edges,
                                            const CutTetrahedra& cut) {
  std::map<FaceKey, int> times;
  for (const Tetrahedron& t : body.tetrahedra)
    for (int face = 0; face < 4; ++face) ++times[key_of(t, face)];
  std::vector<TriangleMesh> meshes(cut.fragment_count());
  std::vector<std::map<PieceVertex, std::uint32_t>> numbers(meshes.size());
  const auto add = [&](std::uint32_t fragment, const TetrahedronPieces::Triangle& triangle) {
    Face face;
    for (int k = 0; k < 3; ++k) {
      const auto [at, made] = numbers[fragment].try_emplace(
          triangle[k], static_cast<std::uint32_t>(meshes[fragment].vertices.size()));
      if (made) meshes[fragment].vertices.push_back(triangle[k].at_mm);
      face[k] = at->second;
    }
    meshes[fragment].faces.push_back(face);
  };
  for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t) {
    const TetrahedronPieces pieces(body, edges, t);
    for (int corner = 0; corner < 4; ++corner) {
      const std::uint32_t own = cut.fragment(cut.copy_at({t, corner}));
      for (int face = 0; face < 4; ++face) {
        if (times[key_of(body.tetrahedra[t], face)] != 1) continue;
        for (const auto& piece : pieces.face_piece(face, corner)) add(own, piece);
      }
      if (pieces.groups()[corner] != corner) continue;
      for (const auto& wall : pieces.walls(corner)) add(own, wall);
    }
  }
  return meshes;
}

}  // namespace organbake
