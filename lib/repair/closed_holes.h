// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

struct ClosedHoles {
  std::size_t closed = 0, left = 0;  // loops of open edges
};

// Closes every hole whose rim fits into a box of this diagonal (mm) with triangles between the
// rim's own vertices (minimal area and bending, Liepa 2003). The mesh must be a manifold.
ClosedHoles close_holes(TriangleMesh& mesh, double largest_mm);

}  // namespace organbake
