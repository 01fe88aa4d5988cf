// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Smooth unit normals of the macro surface at rest, by the layer's nodes: those of the lattice's
// small triangles, by area. Nodes that faces share along the proxy's edges have one normal; slivers
// between them take those of their rim.
// Only of faces from first_face on, which share no vertex with those before.
std::vector<Eigen::Vector3d> lattice_normals(const BaseLayer& layer, const TriangleMesh& proxy,
                                             std::uint32_t first_face = 0);

// The first face of a cut's walls: they follow those of the skin.
std::uint32_t first_wall(std::size_t uncut_faces, const CutOrgan::FaceParts& parts);

// Of skin that blades have cut: `normals`, of its walls as above, become on its faces those that
// the same material had when it was whole, `uncut`. Lips lie flat (CutOrgan) and the faces beside
// them may be narrow, but what lit the skin when its colours were taken is how it lay then.
void keep_uncut_normals(const std::vector<Eigen::Vector3f>& uncut, const CutOrgan::FaceParts& parts,
                        const BaseLayer& layer, std::vector<Eigen::Vector3d>& normals);

}  // namespace organbake
