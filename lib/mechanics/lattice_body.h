// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "bundle/tetrahedral_body.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// Cuts the proxy's inside out of a regular lattice of cubes of `cell_mm`, five tetrahedra each: of
// these all that hold some of the inside or a proxy vertex, with the share that is inside. 0 = a
// cell of three quarters of the proxy's mean edge (some hundreds of tetrahedra in 80 faces), but
// large enough that at most about a thousand fill the body. All nodes that hold an anchor are
// anchors, so that the proxy's own stay where they are. Throws BadDataError for a proxy that is
// not closed and UsageError for cells that would be more than a million.
TetrahedralBody make_lattice_body(const TriangleMesh& proxy,
                                  const std::vector<std::uint32_t>& anchors, double cell_mm);

// In how many parts, not joined by a node, the tetrahedra fall.
std::size_t part_count(const TetrahedralBody& body);

}  // namespace organbake
