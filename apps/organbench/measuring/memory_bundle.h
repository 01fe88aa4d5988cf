// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/bundle.h"
#include "organbake/capture/capture.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

// A bundle as the stages make it, without a file: the surface in its vertices' colours. Throws what
// the stages throw. skin_edge_mm: of the smooth skin over the proxy; 0 = none.
Bundle memory_bundle(const TriangleMesh& surface, const TriangleMesh& proxy,
                     const PlacementOptions& placement, const CaptureOptions& capturing = {},
                     double skin_edge_mm = 6);

}  // namespace organbake
