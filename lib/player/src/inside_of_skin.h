// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/bundle/mechanics_model.h"

namespace organbake {

// Where the vertices lie when the nodes of the tetrahedra that they are embedded in lie elsewhere,
// mm: by how far those are from rest, as the player's solver carries them to rounding. An anchor
// that another solver has moved carries what hangs on it.
void carry_vertices(const TetrahedralBody& body, const std::vector<Eigen::Vector3d>& rest_mm,
                    const std::vector<Eigen::Vector3d>& nodes_mm,
                    std::vector<Eigen::Vector3d>& vertices_mm);

// Nodes that put the vertices where they lie now, nearly, the smoothest there are: displacements u
// that minimise |W u − d|² + ε Σ |u_a − u_b|² over the edges of the tetrahedra, anchors at rest.
std::vector<Eigen::Vector3d> nodes_under(const TetrahedralBody& body,
                                         const std::vector<Eigen::Vector3d>& rest_mm,
                                         const std::vector<Eigen::Vector3d>& vertices_mm);

}  // namespace organbake
