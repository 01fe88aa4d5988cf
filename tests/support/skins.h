// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A smooth skin that is not smooth: every node lies on its face of the proxy, by the corners'
// barycentric weights.
SmoothSkin flat_skin(const TriangleMesh& proxy, std::uint32_t steps);

// The same with each corner's weight spread over its neighbours by this share: carried, like baked
// skins, by more vertices than those of its face.
SmoothSkin spread_skin(const TriangleMesh& proxy, std::uint32_t steps, double share);

}  // namespace organbake
