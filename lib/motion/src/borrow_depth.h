// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "organbake/geometry/camera.h"
#include "plane_sweep.h"

namespace organbake {

// Depth that partners are sure of, where a frame itself is not: a partner's pixel that falls there
// lends its depth with a part of its confidence, the surest first. What hides or is hidden is as
// the frames agreed (check_agreement comes before). All swept[i] are of cameras[i].
void borrow_depth(const std::vector<PosedCamera>& cameras,
                  const std::vector<std::vector<std::size_t>>& partners,
                  std::vector<SweptDepth>& swept);

}  // namespace organbake
