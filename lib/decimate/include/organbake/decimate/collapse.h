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

// Thins a manifold surface (manifold_faces()) to about `faces`, at a million faces a second: edges
// below a quadric error that rises from pass to pass are collapsed as they come, with no queue.
// Link condition, no turned normals: the result is manifold with the same genus and components.
// Vertices at a border stay. Leaves more faces where nothing more can be collapsed.
TriangleMesh fast_collapse(const TriangleMesh& surface, std::size_t faces,
                           const RunContext& context = {});

// Collapses edges by error quadrics (Garland & Heckbert 1997) with OpenMesh's decimater: a widely
// used peer, for comparison; it loses volume at low counts. The surface must be manifold; the
// result is.
TriangleMesh collapse_by_quadrics(const TriangleMesh& surface, std::size_t faces,
                                  const RunContext& context = {});

// Vertex clustering on a regular grid (Rossignac & Borrel 1993): each cell's vertices become their
// mean; faces that lose a corner or their area are dropped, those with equal corners are added up
// by their winding, so that a fold cancels. The cell's size is searched by bisection for the most
// faces within the budget. Need not be manifold. Empty when no grid gives 1 … `faces` faces.
TriangleMesh cluster_vertices(const TriangleMesh& surface, std::size_t faces,
                              const RunContext& context = {});

}  // namespace organbake
