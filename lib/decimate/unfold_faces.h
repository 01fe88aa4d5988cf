// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Flips edges of slivers that lie folded over onto their neighbours, as edge collapses by cost
// alone leave them: face the wrong way, and what is bound to them is drawn inside out. An edge is
// flipped where one of its faces faces away from its neighbours, all faces about the edge lie
// flatter afterwards, and the surface hardly moves. The mesh must be manifold; it stays so. Returns
// the number of flips.
std::size_t unfold_faces(TriangleMesh& mesh);

}  // namespace organbake
