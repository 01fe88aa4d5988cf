// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

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

}  // namespace organbake
