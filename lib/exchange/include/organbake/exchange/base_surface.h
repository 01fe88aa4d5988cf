// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The surface as a bundle's base layer has it, at rest and in its colours: every node counted once,
// so that it is closed where the shell is. The bundle's maps are not asked for. Throws BadDataError
// when the layer is not of the bundle's shell.
TriangleMesh base_surface(const Bundle& bundle);

}  // namespace organbake
