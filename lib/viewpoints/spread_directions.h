// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace organbake {

// `count` unit directions spread evenly over the cap within `half_angle_rad` (0…π) of an axis,
// the first on the axis (unless two or three share a cap of less than a quarter turn: those all
// stand on its rim). They start on a Fibonacci spiral and repel each other with the energy Σ 1/r²
// until they rest (Thomson's problem, with the cap's rim as a wall): four all round make a
// tetrahedron, six an octahedron, eight a square antiprism. Rolled about the axis so that the
// first one's nearest neighbour lies beside it, level with the world's z. Always the same.
std::vector<Eigen::Vector3d> spread_directions(int count, const Eigen::Vector3d& axis,
                                               double half_angle_rad);

}  // namespace organbake
