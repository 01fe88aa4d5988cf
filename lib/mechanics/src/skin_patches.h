// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// What TetrahedralBody::patches holds, by its nodes, tetrahedra, vertices and anchors. place: where
// a point of the skin lies in the tetrahedra, or nothing where none is; step_mm: how far apart it
// is asked at most.
std::vector<std::vector<NodeShare>> skin_patches(
    const TriangleMesh& skin, const TetrahedralBody& body, double step_mm,
    const std::function<std::optional<EmbeddedVertex>(const Eigen::Vector3d&)>& place);

}  // namespace organbake
