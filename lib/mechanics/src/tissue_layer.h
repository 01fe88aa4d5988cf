// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Whether a surface is what one viewpoint has seen of tissue, and not the whole outside of a body:
// most of its faces look the same way.
bool is_sheet(const TriangleMesh& surface);

// The layer of tissue under a sheet, closed: the sheet, its vertices once more `thickness_mm`
// deeper, with their numbers after the sheet's, and sides along its borders. Deeper is against the
// mean of its normals by area, so that a sheet which hides nothing of itself from there does not
// fold.
TriangleMesh tissue_layer(const TriangleMesh& sheet, double thickness_mm);

}  // namespace organbake
