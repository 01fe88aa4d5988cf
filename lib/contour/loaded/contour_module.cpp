// SPDX-License-Identifier: GPL-3.0-or-later
// Marching cubes' surface (Lorensen, Cline 1987), as VTK's flying edges find it (Schroeder,
// Maynard, Geveci 2015), several times faster. Crossings are kept off the grid points: where a
// value equals the level, marching cubes makes triangles without area, on which normals and binding
// fail.
#include "contour_door.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkShortArray.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Of an edge of the grid. Moves one crossing in 128, by 0.4 % of a voxel at most; without it some
// triangles have areas near the square of single precision.
constexpr float kLeastShare = 1.0f / 256;

// A crossing lies on one edge, so at most one coordinate is between two grid planes.
float away_from_grid_point(float x) {
  const float plane = std::floor(x), share = x - plane;
  return share == 0 ? x : plane + std::clamp(share, kLeastShare, 1 - kLeastShare);
}

constexpr std::size_t kGrain = 16384;

TriangleMesh mesh_from(vtkPolyData& surface) {
  TriangleMesh mesh;
  const vtkIdType points = surface.GetNumberOfPoints(), faces = surface.GetNumberOfPolys();
  if (points == 0 || faces == 0) return mesh;
  if (points > std::numeric_limits<std::uint32_t>::max())
    throw BadDataError("the surface has " + std::to_string(points) +
                       " points, more than a mesh can index; crop or resample the volume");
  auto* coordinates = vtkFloatArray::SafeDownCast(surface.GetPoints()->GetData());
  auto* corners =
      surface.GetPolys()->IsStorage64Bit() ? surface.GetPolys()->GetConnectivityArray64() : nullptr;
  if (!coordinates || !corners) throw std::logic_error("VTK changed its output types");
  const float* xyz = coordinates->GetPointer(0);
  const auto* ids = corners->GetPointer(0);
  mesh.vertices.resize(static_cast<std::size_t>(points));
  parallel_each(std::size_t{0}, mesh.vertices.size(), kGrain, [&](std::size_t v) {
    for (int c = 0; c < 3; ++c) mesh.vertices[v][c] = away_from_grid_point(xyz[3 * v + c]);
  });
  mesh.faces.resize(static_cast<std::size_t>(faces));
  parallel_each(std::size_t{0}, mesh.faces.size(), kGrain, [&](std::size_t f) {
    for (int c = 0; c < 3; ++c) mesh.faces[f][c] = static_cast<std::uint32_t>(ids[3 * f + c]);
  });
  return mesh;
}

template <typename Array, typename Value>
TriangleMesh contour_values(std::span<const Value> values, const ContouredGrid& grid) {
  vtkNew<Array> array;
  constexpr int kKeepOwnership = 1;
  // VTK knows no const arrays; the filter only reads.
  array->SetArray(const_cast<Value*>(values.data()), static_cast<vtkIdType>(values.size()),
                  kKeepOwnership);
  vtkNew<vtkImageData> image;
  image->SetDimensions(grid.size.data());
  image->GetPointData()->SetScalars(array);
  // VTK's own threads are TBB's here, and its point numbers do not depend on how many there are.
  vtkNew<vtkFlyingEdges3D> filter;
  filter->InterpolateAttributesOff();
  filter->SetInputData(image);
  filter->SetValue(0, grid.level);
  filter->ComputeNormalsOff();
  filter->ComputeGradientsOff();
  filter->ComputeScalarsOff();
  filter->Update();
  return mesh_from(*filter->GetOutput());
}

}  // namespace
}  // namespace organbake

void organbake_contour(const organbake::ContouredGrid& grid, organbake::TriangleMesh& surface) {
  using namespace organbake;
  surface = grid.real.empty() ? contour_values<vtkShortArray>(grid.whole, grid)
                              : contour_values<vtkFloatArray>(grid.real, grid);
}
