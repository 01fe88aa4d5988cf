// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Thins a manifold surface (manifold_faces()) to about `faces`, at a million faces a second: edges
// below a quadric error that rises from pass to pass are collapsed as they come, with no queue.
// Link condition, no turned normals: the result is manifold with the same genus and components.
// Vertices at a border stay. Leaves more faces where nothing more can be collapsed.
TriangleMesh fast_collapse(const TriangleMesh& surface, std::size_t faces,
                           const RunContext& context = {});

}  // namespace organbake
