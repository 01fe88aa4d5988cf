// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A smooth skin over the proxy along the surface, with edges of about edge_mm. The same for any
// number of threads. Throws UsageError unless edge_mm is positive, BadDataError for broken meshes.
SmoothSkin bake_smooth_skin(const TracedSurface& surface, const TriangleMesh& proxy, double edge_mm,
                            const RunContext& context = {});

}  // namespace organbake
