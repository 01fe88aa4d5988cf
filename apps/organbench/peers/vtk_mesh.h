// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

vtkSmartPointer<vtkPolyData> to_polydata(const TriangleMesh& mesh);
TriangleMesh from_polydata(vtkPolyData& data);  // triangles only

}  // namespace organbake
