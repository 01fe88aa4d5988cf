// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The surface with the colours that the maps show at its vertices, so that it can be compared with
// what is played. Edges longer than finest_mm are halved first, for colours as fine as the maps';
// 0 leaves them. Throws UsageError when finest_mm would take more faces than make sense.
TriangleMesh colored_surface(const TracedSurface& surface, const SurfaceColor& color,
                             double finest_mm);

}  // namespace organbake
