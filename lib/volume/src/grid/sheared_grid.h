// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "organbake/volume/read_options.h"
#include "organbake/volume/volume.h"

namespace organbake {

// A file's affine whose axes are too far from perpendicular for any rectangular grid to stand for
// it: axes_mm = columns, millimetres (LPS) per index.
struct ShearedAffine {
  Eigen::Matrix3d axes_mm = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  double degrees = 0;
};
using Shear = std::optional<ShearedAffine>;

// Sets the grid of a volume, whose size is known, from the affine of a file. Axes that are sheared
// by less than 0.06° (float32 text) are taken silently as the nearest perpendicular ones. Up to
// 0.5°, as converters' rounding leaves them, the nearest rectangular grid about the volume's centre
// is taken, and the warning says how far that moves a voxel. What is sheared by more comes back, to
// be straightened once the voxels are there. Throws BadDataError: axes that are not finite, vanish,
// or are sheared by more than 45°.
Shear set_grid_or_shear(Volume& volume, const Eigen::Matrix3d& axes_mm,
                        const Eigen::Vector3d& origin_mm, const std::string& name);

// The whole volume as stored, brought onto a rectangular grid where it is sheared: along the first
// axis as it was, the second turned in the plane of the first two, the third along their normal; so
// slices that were only pushed along each other stay slices. Values between voxels are linear, or
// the nearest voxel's for a mask; outside is background for a mask, else the lowest value (NaN in a
// volume of real numbers). Then cropped to the region asked for.
Volume straightened(Volume stored, const Shear& shear, const VolumeReadOptions& options,
                    const std::string& name);

}  // namespace organbake
