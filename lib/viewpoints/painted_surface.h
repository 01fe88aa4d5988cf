// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "viewpoints/sight.h"

namespace organbake {

// The surface, a colour a vertex by how many of the cameras show it well: red = none, yellow = one,
// green = two, blue = three or more; grey = none of the region's views does.
TriangleMesh painted_by_cameras(const TriangleMesh& surface, const Sight& sight,
                                const std::vector<Eye>& cameras, const std::vector<Eye>& region,
                                const SightLimits& well);

}  // namespace organbake
