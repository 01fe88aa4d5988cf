// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/camera.h"

namespace organbake {

// What two views of one rigid scene tell of how the scope moved between them.
struct TwoViews {
  RigidTransform second_from_first;  // its translation has length 1
  std::size_t agreeing = 0;          // pairs that this motion explains, in front of both
  double median_angle_rad = 0;       // between their rays
  // How far (pixels, upper fifth) pairs lie from where the best plane, or pure turn, or zoom would
  // have them: without this parallax pictures tell no shape.
  double parallax_px = 0;
};

// `first` and `second`: pixels of the same features. The essential matrix by OpenCV's USAC
// (Barath et al., MAGSAC++ 2020; Nistér's five points), the better of its four motions; none
// agreeing when there are too few pairs. Deterministic.
TwoViews relate_views(const Intrinsics& lens, const std::vector<Eigen::Vector2d>& first,
                      const std::vector<Eigen::Vector2d>& second);

}  // namespace organbake
