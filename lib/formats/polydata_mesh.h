// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "geometry/triangle_mesh.h"

class vtkPolyData;

namespace organbake {

// Triangles of VTK polygons and strips (polygons are cut by VTK's ear clipping). Point colours
// (3 or 4 components of 8 bit) become linear vertex colours. Lines and vertices are dropped.
TriangleMesh mesh_from_polydata(vtkPolyData* polydata);

}  // namespace organbake
