// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// Collapses edges by error quadrics (Garland & Heckbert 1997) with OpenMesh's decimater: a widely
// used peer, for comparison; it loses volume at low counts. The surface must be manifold; the
// result is.
TriangleMesh collapse_by_quadrics(const TriangleMesh& surface, std::size_t faces,
                                  const RunContext& context = {});

}  // namespace organbake
