// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

// How many faces a proxy needs for a tool's tip to dent it: edges of about three times the tip's
// radius. Under a smooth skin a dent as wide as an edge is followed to some 5 % of its depth, one
// of half an edge to 22 %; a tip makes dents of twice to three times its radius. At least 80, the
// paper's, and at most 1,500, whose springs are still solved in a fraction of a frame.
// Throws UsageError unless the radius is positive.
std::size_t faces_for_tool(const TriangleMesh& surface, double tool_radius_mm);

}  // namespace organbake
