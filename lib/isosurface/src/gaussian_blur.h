// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace organbake {

// Separable Gaussian over a grid (x fastest), kernel cut at 3 σ and normalised; σ in voxels for
// each axis, 0 = none. Beyond the grid its outermost values go on. Same result for any number of
// threads.
void gaussian_blur(std::vector<float>& values, const std::array<int, 3>& size,
                   const Eigen::Vector3d& sigma_voxels);

// Number of voxels on each side that the kernel reaches.
int gaussian_reach(double sigma_voxels);

}  // namespace organbake
