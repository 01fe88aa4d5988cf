// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/registration/register_photo.h"

namespace organbake {

// camera_from_world of at least six pairs that do not lie in one plane: direct linear transform on
// undistorted rays (Hartley & Zisserman, Multiple View Geometry, 7.1, with its normalisation), then
// least squares of the pixels by a robust loss. Throws UsageError for fewer pairs or a degenerate
// set.
RigidTransform pose_from_pairs(const std::vector<PointPair>& pairs, const Intrinsics& intrinsics);

}  // namespace organbake
