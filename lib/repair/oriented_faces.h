// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Turns faces so that neighbours across edges of two faces are wound alike, each patch as most of
// its area was wound. Returns how many faces were turned. A patch that cannot be wound alike (a
// Möbius strip) keeps a seam.
std::size_t wind_alike(TriangleMesh& mesh);

// Turns whole closed pieces so that solids look outward and the walls of cavities inward, by how
// many other closed pieces they lie in. Open pieces are left: their winding says which side is
// seen. Returns how many pieces were turned.
std::size_t turn_outward(TriangleMesh& mesh);

}  // namespace organbake
