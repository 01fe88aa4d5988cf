// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The faces between voxels inside and outside of a cube of size³ voxels, corners shared: where
// voxels touch at an edge or a corner alone, the mesh is no manifold.
TriangleMesh voxel_mesh(int size, double voxel_mm,
                        const std::function<bool(int, int, int)>& inside);

}  // namespace organbake
