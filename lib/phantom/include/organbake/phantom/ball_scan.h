// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/volume/volume.h"

namespace organbake {

inline constexpr double kBallAir_hu = -1000, kBallTissue_hu = 60;
inline constexpr double kBallHalfWay_hu = (kBallAir_hu + kBallTissue_hu) / 2;

// A ball round the world's origin as a scanner without noise sees it: every voxel is the mean over
// its box. The grid's middle is off the origin by a part of a voxel and 10 mm of air lie around.
Volume scan_ball(double radius_mm, const Eigen::Vector3d& spacing_mm);

// RMS radial error (mm), over all edges of the grid, of where the straight line between two voxels
// crosses the half-way level: what marching cubes reaches when it does nothing wrong.
double linear_crossing_rms_mm(const Volume& ball, double radius_mm);

}  // namespace organbake
