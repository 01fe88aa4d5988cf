// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A proxy of at most `faces` by the method of the options (not cluster). The surface must be
// manifold (manifold_faces()).
TriangleMesh proxy_with_faces(const TriangleMesh& surface, const DecimateOptions& options,
                              std::size_t faces, const RunContext& context = {});

// The largest distance found both ways: from dense samples (at least kFewestErrorSamples, several
// a face) and all vertices of each surface to the other's closest points.
double verified_distance(const TriangleMesh& surface, const TriangleMesh& proxy,
                         const RunContext& context = {});

// A proxy with few faces whose verified distance keeps options.max_error_mm: the face count is
// searched, and what is returned has been measured. The surface itself when nothing less will do.
TriangleMesh fewest_faces(const TriangleMesh& surface, const DecimateOptions& options,
                          const RunContext& context = {});

}  // namespace organbake
