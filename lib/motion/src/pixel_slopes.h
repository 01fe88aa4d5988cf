// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/geometry/camera.h"

namespace organbake {

// How a pixel moves with its point (camera axes, z > 0) through any lens, by differences in the
// plane z = 1.
Eigen::Matrix<double, 2, 3> pixel_slopes(const Intrinsics& lens, const Eigen::Vector3d& point);

}  // namespace organbake
