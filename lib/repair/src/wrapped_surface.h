// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A closed manifold round a surface of any kind, without what is narrower than `closes_mm`
// (tunnels, gaps, what lies inside), pulled back onto the surface where it lies near. Without
// colours. Source: Portaneri et al., Alpha wrapping with an offset, 2022 (CGAL).
TriangleMesh wrapped_surface(const TriangleMesh& surface, double closes_mm);

}  // namespace organbake
