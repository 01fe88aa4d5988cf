// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Collapses edges by the memoryless volume- and boundary-preserving cost of Lindstrom & Turk
// (1998) until at most `faces` are left or no collapse keeps the topology. The surface must be
// manifold (manifold_faces()); the result is.
TriangleMesh collapse_edges(const TriangleMesh& surface, std::size_t faces,
                            const RunContext& context = {});

// Collapses edges by error quadrics (Garland & Heckbert 1997) with OpenMesh's decimater: a widely
// used peer, for comparison; it loses volume at low counts. The surface must be manifold; the
// result is.
TriangleMesh collapse_by_quadrics(const TriangleMesh& surface, std::size_t faces,
                                  const RunContext& context = {});

}  // namespace organbake
