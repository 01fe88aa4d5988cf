// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "isosurface/isosurface.h"

namespace organbake {

// What CT and mask surfaces share once they lie in the world: the pieces' filter and the smoothing.
// Throws BadDataError when no piece is left.
Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options, const RunContext& context);

}  // namespace organbake
