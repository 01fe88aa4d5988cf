// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "geometry/triangle_mesh.h"

namespace organbake {

// The surface as a half-edge structure can hold it: faces with a repeated corner dropped (their
// neighbours then meet), vertices where several fans touch split into one copy a fan, unused
// vertices dropped, colours dropped. Faces of a closed surface are turned outward as a whole when
// the volume is negative; single components are left as they are, for an inward one may be a
// cavity. Throws BadDataError with the count when edges have three or more faces, or neighbouring
// faces are wound against each other: such a surface has no unique repair.
TriangleMesh manifold_faces(const TriangleMesh& surface);

}  // namespace organbake
