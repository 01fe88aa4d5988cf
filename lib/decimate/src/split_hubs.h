// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Gives vertices with hundreds of faces, such as the middle of a cap or the tip of a cone, fewer:
// spokes become edges between the spokes beside them, where no face turns by more than 60°. The
// mesh must be manifold; it stays so, with as many faces. Throws BadDataError where thousands stay.
void split_hubs(TriangleMesh& mesh);

}  // namespace organbake
