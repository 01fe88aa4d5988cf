// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Forces on a proxy's vertices, one load in a column: x, y, z of each vertex, N.
struct DeadLoads {
  Eigen::MatrixXd fitted;
  Eigen::MatrixXd held_out;  // round other vertices
};

// A newton on a patch round every vertex that gives way, along its normal and two tangents: half on
// the vertex, the rest on its free neighbours. The patches of every third such vertex are held out.
DeadLoads patch_loads(const TriangleMesh& proxy, const std::vector<std::uint32_t>& anchors);

}  // namespace organbake
