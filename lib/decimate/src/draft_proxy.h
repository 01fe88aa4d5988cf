// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A proxy of at most `faces` faces, where the surface's topology allows that, for a first look,
// in some hundredths of a second from a scan's surface. A manifold; of large surfaces gaps that are
// narrower than the clusters may have closed.
TriangleMesh draft_proxy(const TriangleMesh& surface, std::size_t faces,
                         const RunContext& context = {});

}  // namespace organbake
