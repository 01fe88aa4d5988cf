// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Flips edges of slivers that lie folded over onto their neighbours, as edge collapses by cost
// alone leave them: they face the wrong way, and what is bound to them is drawn inside out. Looked
// at are faces more than a right angle from a neighbour. An edge of theirs is flipped where the
// sharpest of the edges concerned gets flatter and the surface hardly moves: a real ridge stays.
// The mesh must be manifold; it stays so. Returns the number of flips.
std::size_t unfold_faces(TriangleMesh& mesh);

}  // namespace organbake
