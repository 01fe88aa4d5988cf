// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fuzz/drawn.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A small solid (4…320 faces, some 10 mm) that stays closed and outward, pushed and bent.
TriangleMesh sound_mesh(Drawn& drawn);

// The same after up to seven changes: most leave a closed mesh closed, others tear it, double or
// turn faces, weld vertices, put bodies side by side, or put in bad numbers and indices.
TriangleMesh grown_mesh(Drawn& drawn);

}  // namespace organbake
