// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

#include "organbake/volume/volume.h"

namespace organbake {

// Sine of the largest angle by which two axes miss being perpendicular; NaN when one has no length.
double shear_sine(const Eigen::Matrix3d& axes_mm);
// 0.06°: a shear that moves a voxel by 0.3 mm at 300 mm.
inline constexpr double kLargestShear = 1e-3;

// Sets spacing, direction and origin from the affine of a file: axes = columns, millimetres (LPS)
// per index. Throws BadDataError for axes that are not finite, vanish or are sheared by more than
// 0.06°; the rest of a shear (float32 text) is taken out by the nearest orthonormal matrix.
void set_grid(Volume& volume, const Eigen::Matrix3d& axes_mm, const Eigen::Vector3d& origin_mm,
              const std::string& name);

// Turns a RAS affine into an LPS one: the first two world axes change sign.
inline Eigen::Matrix3d lps_from_ras(const Eigen::Matrix3d& axes) {
  return Eigen::Vector3d(-1, -1, 1).asDiagonal() * axes;
}
inline Eigen::Vector3d lps_from_ras(const Eigen::Vector3d& point) {
  return {-point.x(), -point.y(), point.z()};
}

// Checks a header's sizes before memory is taken and returns the number of voxels: 1…65535 along
// each axis, at most 2³¹ in all. Throws BadDataError.
std::size_t checked_voxel_count(const std::array<std::int64_t, 3>& size, const std::string& name);
// The same of sizes that were calculated: whole numbers, as far as they are numbers at all.
std::size_t checked_grid_size(const Eigen::Vector3d& size, const std::string& name);

}  // namespace organbake
