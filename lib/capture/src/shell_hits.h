// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/lattice.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// How far from the proxy the shell must reach: some surface points' distances tell, with room for
// points between them and for shell lines that lean. A point beyond is bound to the nearest face.
double shell_reach_mm(const TriangleMesh& surface, const TriangleMesh& proxy);

// Where shell lines meet the surface: of all meetings within reach_mm of the foot, both ways, the
// nearest whose normal agrees with the line; where there is none, the closest surface point. A
// hit's t is the height over the foot, in lengths of the line's direction.
std::vector<RayHit> shell_hits(const std::vector<Lattice::ShellLine>& lines,
                               const TracedSurface& surface, double reach_mm,
                               const RunContext& context);

}  // namespace organbake
