// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Closed pieces that overlap become their union, each place counted once (corefinement in exact
// numbers: CGAL, Polygon Mesh Processing); colours go along. Pieces that only touch, or lie within
// one another, stay as they are. The mesh must be a manifold.
struct UnitedPieces {
  std::size_t pieces = 0;  // that overlapped
  double shared_mm3 = 0;   // counted more than once before; where it was refused, at the most
  bool refused = false;    // the pieces cross themselves, too: the mesh is as it was
};
UnitedPieces unite_overlapping_pieces(TriangleMesh& mesh);

}  // namespace organbake
