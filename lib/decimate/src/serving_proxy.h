// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/run_context.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/triangle_mesh.h"
#include "region_errors.h"

namespace organbake {

// A proxy of options.faces faces as its method makes it, for serving_proxy() to begin with. The
// surface must be manifold (manifold_faces()).
TriangleMesh proxy_to_serve(const TriangleMesh& surface, const DecimateOptions& options,
                            const RunContext& context = {});

// A proxy, and what the meter says of it.
struct MeasuredProxy {
  TriangleMesh mesh;
  RegionErrors errors = {};
};

// Where a few places of the first proxy lie off by more than options.max_share of the thickness,
// vertices are added there, each fitted with its neighbours; where it is too coarse as a whole,
// more faces are asked for, and the largest distance is what is lowered. The nearest of those
// tried, with options.most_faces at most. The surface must be the first proxy's and the meter's.
MeasuredProxy serving_proxy(const TriangleMesh& surface, TriangleMesh first,
                            const RegionMeter& meter, const DecimateOptions& options,
                            const RunContext& context = {});

}  // namespace organbake
