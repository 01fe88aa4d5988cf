// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/smooth_skin.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// A smooth skin that is not smooth: every node lies on its face of the proxy, by the corners'
// barycentric weights.
SmoothSkin flat_skin(const TriangleMesh& proxy, std::uint32_t steps);

}  // namespace organbake
