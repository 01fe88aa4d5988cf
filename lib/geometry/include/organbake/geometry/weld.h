// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct WeldSummary {
  std::size_t exact = 0;    // vertices merged into others at the very same place
  std::size_t near = 0;     // into others within the tolerance
  double tolerance_mm = 0;  // that was used for those; 0 = none
};

// Merges the vertices of open edges that coincide: exactly; then, if edges are still open, within
// 1e-6 of the mesh's size where that closes edges and makes none non-manifold. Vertices inside the
// surface are left alone, so that bodies which touch stay apart. A merged vertex has the mean
// colour. Faces that shrink to an edge are dropped. The mesh must be checked (check_mesh).
WeldSummary weld(TriangleMesh& mesh);

}  // namespace organbake
