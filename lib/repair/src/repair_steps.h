// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct ClosedHoles {
  std::size_t closed = 0, left = 0;  // loops of open edges
};

// Closes every hole that is no wider than this (mm, the largest distance of two points of its rim)
// with triangles between the rim's own vertices (minimal area and bending, Liepa 2003). The mesh
// must be a manifold.
ClosedHoles close_holes(TriangleMesh& mesh, double largest_mm);

// Parts what touches along edges of four or more faces, or at a vertex of several fans: round each
// such edge the two faces that bound the same solid stay together, and every fan of faces gets a
// vertex of its own; vertices without a face go. Faces must look outward. Colours go along. Returns
// how many vertices were added.
std::size_t split_edges(TriangleMesh& mesh);

// Drops faces that are lines: whose height is below within_mm. Returns how many.
std::size_t drop_slivers(TriangleMesh& mesh, double within_mm);

// Cuts faces at open edges on which vertices of other open edges lie (T-junctions), to within_mm:
// the edges then meet and the slit between them is gone. Colours and vertices stay. Returns how
// many edges were cut.
std::size_t cut_at_touching_vertices(TriangleMesh& mesh, double within_mm);

// Closed pieces that overlap become their union, each place counted once (corefinement in exact
// numbers: CGAL, Polygon Mesh Processing); colours go along. Pieces that only touch, or lie within
// one another, stay as they are. The mesh must be a manifold.
struct UnitedPieces {
  std::size_t pieces = 0;  // that overlapped
  double shared_mm3 = 0;   // counted more than once before; where it was refused, at the most
  bool refused = false;    // the pieces cross themselves, too: the mesh is as it was
};
UnitedPieces unite_overlapping_pieces(TriangleMesh& mesh);

// A closed manifold round a surface of any kind, without what is narrower than `closes_mm`
// (tunnels, gaps, what lies inside), pulled back onto the surface where it lies near. Without
// colours. Source: Portaneri et al., Alpha wrapping with an offset, 2022 (CGAL).
TriangleMesh wrapped_surface(const TriangleMesh& surface, double closes_mm);

}  // namespace organbake
