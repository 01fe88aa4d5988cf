// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Drops faces that are lines: whose height is below within_mm. Returns how many.
std::size_t drop_slivers(TriangleMesh& mesh, double within_mm);

// Cuts faces at open edges on which vertices of other open edges lie (T-junctions), to within_mm:
// the edges then meet and the slit between them is gone. Colours and vertices stay. Returns how
// many edges were cut.
std::size_t cut_at_touching_vertices(TriangleMesh& mesh, double within_mm);

}  // namespace organbake
