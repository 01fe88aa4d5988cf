// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Smooths a mesh by pairs of umbrella steps, one inward and one outward (Taubin 1995), which leaves
// the shape's large features in place. What the closed mesh's volume changes all the same is given
// back by moving it along its normals, to 0.01 %. Vertices on a boundary stay. Same result for any
// number of threads.
void taubin_smooth(TriangleMesh& mesh, int steps, const RunContext& context = {});

}  // namespace organbake
