// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"
#include "organbake/cutting/edge_crossings.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The edges of all tetrahedra.
std::vector<EdgeCrossings::Edge> edges_of(const std::vector<Tetrahedron>& tetrahedra);

// Tissue by the corner of a tetrahedron that it is at, whatever is cut there.
struct TetrahedronCorner {
  std::uint32_t tetrahedron = 0;
  int corner = 0;
};

// A body's tetrahedra when sheets have crossed their edges. A tetrahedron whose corners fall apart,
// joined by edges that are whole, is there once for each of these groups of corners: elements are
// copied whole and never cut up, so none is a sliver (the virtual nodes of Molino et al. 2004). The
// copies share their nodes with those beside them that hold the same tissue, and where a cut ends
// within a tetrahedron, both its sides.
class CutTetrahedra {
 public:
  struct Copy {
    std::uint32_t tetrahedron = 0;
    std::uint8_t corners = 0;  // bits: those whose tissue it holds
    std::array<std::uint32_t, 4> nodes{};
    double share = 1;  // of the tetrahedron's volume
  };

  CutTetrahedra(const TetrahedralBody& body, const EdgeCrossings& edges);

  // In the order of the tetrahedra.
  const std::vector<Copy>& copies() const { return copies_; }
  std::uint32_t first_copy(std::uint32_t tetrahedron) const { return first_[tetrahedron]; }
  std::uint32_t end_copy(std::uint32_t tetrahedron) const { return first_[tetrahedron + 1]; }
  // That holds the tissue at a corner.
  std::uint32_t copy_at(const TetrahedronCorner& at) const;
  // The first of those that a copy holds.
  TetrahedronCorner held_corner(std::uint32_t copy) const;
  bool split(std::uint32_t tetrahedron) const {
    return end_copy(tetrahedron) - first_copy(tetrahedron) > 1;
  }
  // Nodes: the body's own with their numbers, then copies.
  std::size_t node_count() const { return original_.size(); }
  std::uint32_t original(std::uint32_t node) const { return original_[node]; }
  // The pieces that the body has fallen into, numbered by their first copy.
  std::uint32_t fragment_count() const { return fragment_count_; }
  std::uint32_t fragment(std::uint32_t copy) const { return fragment_[copy]; }
  bool same_as(const CutTetrahedra& other) const;

  // mm³ by fragment, of whole tetrahedra (their fill is not asked for).
  std::vector<double> fragment_volumes(const TetrahedralBody& body) const;

 private:
  void make_copies(const TetrahedralBody& body, const EdgeCrossings& edges);
  void join_nodes(const TetrahedralBody& body);
  void drop_doubles();
  void number_fragments();

  std::vector<Copy> copies_;
  std::vector<std::uint32_t> first_, original_, fragment_;
  std::uint32_t fragment_count_ = 0;
};

// The surface of each fragment: closed. Faces of the body, and across each cut tetrahedron flat
// pieces between the places where its edges are cut.
std::vector<TriangleMesh> fragment_surfaces(const TetrahedralBody& body, const EdgeCrossings& edges,
                                            const CutTetrahedra& cut);

}  // namespace organbake
