// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/geometry/triangle_mesh.h"

class vtkPolyData;

namespace organbake {

// Triangles of VTK polygons and strips (polygons are cut by VTK's ear clipping). Colours of points,
// else of cells (3 or 4 components: active bytes, or any array named rgb… or …color…), become
// linear vertex colours; bytes are sRGB, and so are other numbers unless `linear_colors`. Lines and
// vertices are dropped. Throws BadDataError with `name` for an index that names no point.
TriangleMesh mesh_from_polydata(vtkPolyData* polydata, const std::string& name,
                                bool linear_colors = false);

}  // namespace organbake
