// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "geometry/triangle_mesh.h"

namespace organbake {

// How far each vertex is from the mesh's border along its edges, in mm; nothing when the mesh has
// none. An edge is border when one face has it; corners at the very same place are one, so that
// triangles that don't share their vertices (STL) have no border between them.
std::vector<float> border_distance_mm(const TriangleMesh& mesh);

}  // namespace organbake
