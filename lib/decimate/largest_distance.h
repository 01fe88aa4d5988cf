// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"
#include "raycast/ray_scene.h"

namespace organbake {

// The one-sided Hausdorff distance in mm from all points of `from`, not samples, to `to` (whose
// search tree is `scene`), by branch and bound over the faces of `from`: never below it and at most
// half a percent above, as far as pieces of 1/1024 of a face's edge tell. The same for any number
// of threads. Throws BadDataError when `from` is unusable.
double largest_distance(const TriangleMesh& from, const TriangleMesh& to, const RayScene& scene,
                        const RunContext& context = {});

}  // namespace organbake
