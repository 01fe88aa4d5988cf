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

// About how far apart neighbours are when `count` share the cap evenly.
double even_spacing_rad(std::size_t count, double half_angle_rad);

// Many unit directions over the same cap at once, on a Fibonacci spiral: even, not at rest. Those
// `on_rim` begin on the axis and end with a ring along the cap's rim (more than `count` in all);
// the others keep half a step off both, so that the two share no direction.
enum class LatticeKind { on_rim, off_rim };
std::vector<Eigen::Vector3d> lattice_directions(int count, const Eigen::Vector3d& axis,
                                                double half_angle_rad, LatticeKind lattice);

}  // namespace organbake
