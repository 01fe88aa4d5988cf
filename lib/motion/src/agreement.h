// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "organbake/geometry/camera.h"
#include "plane_sweep.h"

namespace organbake {

// Holds the depths of several frames against each other, each one's against its partners'
// (indices): confidence rises where partners have the surface at the same place, and falls where it
// would hide what they see. Where no partner looks it stays. All swept[i] are of cameras[i].
void check_agreement(const std::vector<PosedCamera>& cameras,
                     const std::vector<std::vector<std::size_t>>& partners,
                     std::vector<SweptDepth>& swept);

}  // namespace organbake
