// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Smooths a mesh by pairs of umbrella steps, one inward and one outward (Taubin 1995), which leaves
// the shape's large features in place. What the closed mesh's volume changes all the same is given
// back by moving it along its normals, to 0.01 %. Vertices on a boundary stay. Same result for any
// number of threads.
void taubin_smooth(TriangleMesh& mesh, int steps, const RunContext& context = {});

// Separable Gaussian over a grid (x fastest), kernel cut at 3 σ and normalised; σ in voxels for
// each axis, 0 = none. Beyond the grid its outermost values go on. Same result for any number of
// threads.
void gaussian_blur(std::vector<float>& values, const std::array<int, 3>& size,
                   const Eigen::Vector3d& sigma_voxels);

// Number of voxels on each side that the kernel reaches.
int gaussian_reach(double sigma_voxels);

}  // namespace organbake
