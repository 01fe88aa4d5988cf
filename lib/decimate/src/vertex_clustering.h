// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Vertex clustering on a regular grid (Rossignac & Borrel 1993): each cell's vertices become their
// mean; faces that lose a corner or their area are dropped, those with equal corners are added up
// by their winding, so that a fold cancels. The cell's size is searched by bisection for the most
// faces within the budget. Need not be manifold. Empty when no grid gives 1 … `faces` faces.
TriangleMesh cluster_vertices(const TriangleMesh& surface, std::size_t faces,
                              const RunContext& context = {});

// The same with cells of a given size.
TriangleMesh cluster_with_cell(const TriangleMesh& surface, double cell_mm);

}  // namespace organbake
