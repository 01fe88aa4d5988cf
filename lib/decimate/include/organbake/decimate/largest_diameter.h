// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The largest distance between two vertices, to one part in 10⁵ (the "maximum 3D diameter" of
// IBSI's reference manual, 3.1.11). Pairs of boxes are halved as long as their farthest corners lie
// further apart than what was found: in the order of n log n, for balls, too. 0 for less than two
// vertices.
double largest_diameter_mm(const TriangleMesh& mesh);

}  // namespace organbake
