// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "geometry/triangle_mesh.h"

namespace organbake {

// `after` with the vertices round any faces that meet others drawn back towards `before` (same
// faces, other places), until it meets itself no more than `before` does.
TriangleMesh keep_apart(const TriangleMesh& before, TriangleMesh after);

}  // namespace organbake
