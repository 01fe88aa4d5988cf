// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/capture/smooth_normals.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/lattice.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

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

// Weights that carry a smooth skin's nodes by the vertices of its proxy: the motion of the vertices
// is interpolated by thin plates (Duchon 1977: the kernel r³ beside affine functions, which it
// reproduces), one through the vertices nearest to each vertex along the proxy, blended into one
// smooth map by weights that fade with the distance (a partition of unity: Babuška & Melenk 1997;
// the kernel: Wendland 1995).
//
// A place counts together with its direction: r² = |Δx|² + ℓ² |Δn|², ℓ half an edge of the proxy.
// Two sides of a thin sheet or of a fold, however near, are then far from each other, and skin does
// not follow what lies across.
//
// Where the vertices near by lie in a plane they say nothing of what leaves it: the skin stays in
// the plane and the rest is microstructure.
SmoothSkin skin_weights(const TriangleMesh& proxy, const Lattice& lattice,
                        const std::vector<SkinTarget>& targets);

}  // namespace organbake
