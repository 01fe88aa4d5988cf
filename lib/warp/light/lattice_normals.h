// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "bundle/base_layer.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// Visits a face's nodes: visit(i, j, node), as base_node_index() numbers them.
template <class Visit>
void each_node(std::uint32_t steps, Visit&& visit) {
  for (std::uint32_t i = 0; i <= steps; ++i)
    for (std::uint32_t j = 0; i + j <= steps; ++j) visit(i, j, base_node_index(steps, i, j));
}

// Smooth unit normals of the macro surface at rest, by the layer's nodes: those of the lattice's
// small triangles, by area. Nodes that faces share along the proxy's edges have one normal; slivers
// between them take those of their rim.
std::vector<Eigen::Vector3d> lattice_normals(const BaseLayer& layer, const TriangleMesh& proxy);

}  // namespace organbake
