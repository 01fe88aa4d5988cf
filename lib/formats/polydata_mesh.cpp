// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/polydata_mesh.h"

#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkTriangleFilter.h>
#include <vtkUnsignedCharArray.h>

#include <limits>

#include "core/error.h"
#include "formats/vtk_error_log.h"
#include "image/srgb.h"

namespace organbake {
namespace {

std::vector<Eigen::Vector3f> linear_colors(vtkPolyData* polydata) {
  auto* scalars = vtkUnsignedCharArray::SafeDownCast(polydata->GetPointData()->GetScalars());
  if (!scalars || scalars->GetNumberOfComponents() < 3) return {};
  if (scalars->GetNumberOfTuples() != polydata->GetNumberOfPoints()) return {};
  const auto& linear = linear_from_srgb8();
  std::vector<Eigen::Vector3f> colors(static_cast<std::size_t>(scalars->GetNumberOfTuples()));
  for (std::size_t v = 0; v < colors.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      colors[v][c] = linear[scalars->GetTypedComponent(static_cast<vtkIdType>(v), c)];
    }
  }
  return colors;
}

void append_faces(vtkCellArray* polygons, std::vector<Face>& faces) {
  faces.reserve(static_cast<std::size_t>(polygons->GetNumberOfCells()));
  const auto cell = vtk::TakeSmartPointer(polygons->NewIterator());
  for (cell->GoToFirstCell(); !cell->IsDoneWithTraversal(); cell->GoToNextCell()) {
    vtkIdType count = 0;
    const vtkIdType* corners = nullptr;
    cell->GetCurrentCell(count, corners);
    if (count != 3) continue;
    Face face;
    for (int c = 0; c < 3; ++c) face[c] = static_cast<std::uint32_t>(corners[c]);
    faces.push_back(face);
  }
}

// vtkTriangleFilter trusts indices, so they are looked at before it sees them.
void check_indices(vtkCellArray* cells, vtkIdType point_count, const std::string& name) {
  const auto cell = vtk::TakeSmartPointer(cells->NewIterator());
  for (cell->GoToFirstCell(); !cell->IsDoneWithTraversal(); cell->GoToNextCell()) {
    vtkIdType count = 0;
    const vtkIdType* corners = nullptr;
    cell->GetCurrentCell(count, corners);
    for (vtkIdType c = 0; c < count; ++c) {
      if (corners[c] >= 0 && corners[c] < point_count) continue;
      throw BadDataError(name + ": a face uses point " + std::to_string(corners[c]) + " of " +
                         std::to_string(point_count));
    }
  }
}

}  // namespace

TriangleMesh mesh_from_polydata(vtkPolyData* polydata, const std::string& name) {
  const vtkIdType point_count = polydata->GetNumberOfPoints();
  if (point_count > std::numeric_limits<std::uint32_t>::max()) {
    throw BadDataError(name + ": " + std::to_string(point_count) +
                       " points are more than a mesh can index");
  }
  check_indices(polydata->GetPolys(), point_count, name);
  check_indices(polydata->GetStrips(), point_count, name);
  vtkNew<vtkTriangleFilter> triangles;
  VtkErrorLog errors;
  errors.watch(triangles);
  triangles->SetInputData(polydata);
  triangles->PassLinesOff();
  triangles->PassVertsOff();
  triangles->Update();

  TriangleMesh mesh;
  vtkPolyData* cut = triangles->GetOutput();
  mesh.vertices.resize(static_cast<std::size_t>(point_count));
  for (vtkIdType v = 0; v < point_count; ++v) {
    polydata->GetPoint(v, mesh.vertices[static_cast<std::size_t>(v)].data());
  }
  mesh.colors = linear_colors(polydata);
  append_faces(cut->GetPolys(), mesh.faces);
  return mesh;
}

}  // namespace organbake
