// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// The surface with its normals outward: a closed one that is inside out is turned, with a warning.
TriangleMesh outward(TriangleMesh surface, const RunContext& context);

}  // namespace organbake
