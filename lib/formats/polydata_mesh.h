// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "geometry/triangle_mesh.h"

class vtkPolyData;

namespace organbake {

// Triangles of VTK polygons and strips (polygons are cut by VTK's ear clipping). Point colours
// (3 or 4 components of 8 bit) become linear vertex colours. Lines and vertices are dropped. Throws
// BadDataError with `name` for an index that names no point.
TriangleMesh mesh_from_polydata(vtkPolyData* polydata, const std::string& name);

}  // namespace organbake
