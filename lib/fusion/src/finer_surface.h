// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The surface with no edge longer than `longest_mm`, bent smoothly between the coarse vertices, so
// that colours can be kept finer than voxels tell shape. Borders stay. Throws UsageError where that
// takes too many faces.
TriangleMesh finer_surface(const TriangleMesh& coarse, double longest_mm);

}  // namespace organbake
