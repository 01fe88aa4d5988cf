// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// What has become of a mesh whose cells, triangles or tetrahedra, were made finer.
struct Bisection {
  // Of each node that came to it, behind those that it had: the ends of the edge that it halves.
  std::vector<std::array<std::uint32_t, 2>> halved;
  // Of each cell the one that it is part of, by its number before.
  std::vector<std::uint32_t> part_of;

  bool none() const { return halved.empty(); }
};

// Halves the longest edges of cells, with all that lie round them, until none is coarse:
// is_coarse(c) for the number of one of the mesh's as it is then. Neighbours whose own longest edge
// is another are halved there first, so that cells match and no shape gets worse without end
// (Rivara 1984). One of the halves keeps the cell's number.
Bisection bisect(TriangleMesh& mesh, const std::function<bool(std::uint32_t)>& is_coarse);
// Where both ends of an edge are anchors, its middle is one. Parts keep the whole's fill; embedded
// vertices are dropped.
Bisection bisect(TetrahedralBody& body, const std::function<bool(std::uint32_t)>& is_coarse);

// mm, of the longest of a cell's edges.
double longest_edge_mm(const TriangleMesh& mesh, const Face& face);
double longest_edge_mm(const TetrahedralBody& body, const Tetrahedron& tetrahedron);

}  // namespace organbake
