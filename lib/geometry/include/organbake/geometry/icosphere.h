// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The unit icosahedron with every face cut in four `subdivisions` times (0…9): 20 · 4^n outward
// faces, vertices on the unit sphere. Vertices of level n come first in level n + 1.
TriangleMesh make_icosphere(int subdivisions);

}  // namespace organbake
