// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes/polydata_mesh.h"

#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkTriangleFilter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/formats/vtk_error_log.h"
#include "organbake/geometry/written_color.h"

namespace organbake {
namespace {

// The active scalars when they are bytes; else the first array that is named as colours are.
vtkDataArray* color_array(vtkDataSetAttributes* data) {
  const auto usable = [](vtkDataArray* a) {
    return a && (a->GetNumberOfComponents() == 3 || a->GetNumberOfComponents() == 4);
  };
  if (vtkDataArray* active = data->GetScalars();
      usable(active) && vtkUnsignedCharArray::SafeDownCast(active)) {
    return active;
  }
  for (int i = 0; i < data->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = data->GetArray(i);
    if (!usable(array) || !array->GetName()) continue;
    std::string name = array->GetName();
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
      return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
    });
    if (name.find("color") != std::string::npos || name.find("colour") != std::string::npos ||
        name.starts_with("rgb")) {
      return array;
    }
  }
  return nullptr;
}

std::vector<Eigen::Vector3f> colors_of(vtkDataSetAttributes* data, vtkIdType count, bool linear) {
  vtkDataArray* array = color_array(data);
  if (!array || array->GetNumberOfTuples() != count) return {};
  std::vector<Eigen::Vector3d> written(static_cast<std::size_t>(count));
  for (std::size_t v = 0; v < written.size(); ++v) {
    for (int c = 0; c < 3; ++c) written[v][c] = array->GetComponent(static_cast<vtkIdType>(v), c);
  }
  const ColorScale scale = array->GetDataType() == VTK_UNSIGNED_CHAR    ? ColorScale::byte
                           : array->GetDataType() == VTK_UNSIGNED_SHORT ? ColorScale::two_bytes
                           : linear                                     ? ColorScale::linear
                                                                        : ColorScale::number;
  return linear_colors(written, scale);
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

// vtkTriangleFilter reads the first two points of a strip before it counts them.
void check_strips(vtkCellArray* strips, const std::string& name) {
  for (vtkIdType s = 0; s < strips->GetNumberOfCells(); ++s) {
    const vtkIdType points = strips->GetCellSize(s);
    if (points < 3)
      throw BadDataError(name + ": triangle strip " + std::to_string(s) + " has " +
                         std::to_string(points) + " points; a triangle takes three");
  }
}

}  // namespace

TriangleMesh mesh_from_polydata(vtkPolyData* polydata, const std::string& name,
                                bool linear_colors) {
  const vtkIdType point_count = polydata->GetNumberOfPoints();
  if (point_count > std::numeric_limits<std::uint32_t>::max()) {
    throw BadDataError(name + ": " + std::to_string(point_count) +
                       " points are more than a mesh can index");
  }
  check_indices(polydata->GetPolys(), point_count, name);
  check_indices(polydata->GetStrips(), point_count, name);
  check_strips(polydata->GetStrips(), name);
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
  mesh.colors = colors_of(polydata->GetPointData(), point_count, linear_colors);
  append_faces(cut->GetPolys(), mesh.faces);
  if (mesh.colors.empty()) {
    const auto cells = colors_of(cut->GetCellData(), cut->GetNumberOfCells(), linear_colors);
    if (cells.size() == mesh.faces.size())
      mesh.colors = vertex_from_face_colors(mesh.faces, cells, mesh.vertices.size());
  }
  return mesh;
}

}  // namespace organbake
