// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// Collapses edges by the memoryless volume- and boundary-preserving cost of Lindstrom & Turk
// (1998) until at most `faces` are left or no collapse keeps the topology. The surface must be
// manifold (manifold_faces()); the result is.
TriangleMesh collapse_edges(const TriangleMesh& surface, std::size_t faces,
                            const RunContext& context = {});

}  // namespace organbake
