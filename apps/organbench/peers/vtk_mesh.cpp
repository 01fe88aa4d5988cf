// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/vtk_mesh.h"

#include <vtkCellArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>

namespace organbake {

vtkSmartPointer<vtkPolyData> to_polydata(const TriangleMesh& mesh) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& v : mesh.vertices) points->InsertNextPoint(v.data());
  vtkNew<vtkCellArray> polys;
  for (const Face& f : mesh.faces) {
    const vtkIdType corners[3] = {f[0], f[1], f[2]};
    polys->InsertNextCell(3, corners);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(polys);
  return data;
}

TriangleMesh from_polydata(vtkPolyData& data) {
  TriangleMesh mesh;
  for (vtkIdType v = 0; v < data.GetNumberOfPoints(); ++v) {
    mesh.vertices.push_back(Eigen::Vector3d::Map(data.GetPoint(v)));
  }
  vtkNew<vtkIdList> ids;
  for (vtkIdType f = 0; f < data.GetNumberOfPolys(); ++f) {
    data.GetPolys()->GetCellAtId(f, ids);
    const auto corner = [&](vtkIdType c) { return static_cast<std::uint32_t>(ids->GetId(c)); };
    mesh.faces.push_back({corner(0), corner(1), corner(2)});
  }
  return mesh;
}

}  // namespace organbake
