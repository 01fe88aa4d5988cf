// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "capture/smooth_normals.h"
#include "core/run_context.h"
#include "geometry/lattice.h"
#include "geometry/triangle_mesh.h"
#include "raycast/ray_scene.h"

namespace organbake {

// Where a node of a smooth skin should lie at rest.
struct SkinTarget {
  Eigen::Vector3d at_mm;
  Eigen::Vector3d normal;  // unit, outward, smooth over about an edge of the proxy
};

// On the surface, where the nodes' shell lines meet it, without bumps too small for the skin: those
// stay in the microstructure. No face of the skin is turned over against its proxy's. By node.
std::vector<SkinTarget> skin_targets(const TriangleMesh& proxy, const Lattice& lattice,
                                     const RayScene& rays, const SmoothNormals& normals,
                                     double reach_mm, const RunContext& context);

}  // namespace organbake
