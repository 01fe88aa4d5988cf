// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/contours.h"

#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkShortArray.h>
#include <vtkSmartPointer.h>

#include "peers/vtk_mesh.h"

namespace organbake {
namespace {

vtkSmartPointer<vtkImageData> image_of(const Volume& ct) {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(ct.size[0], ct.size[1], ct.size[2]);
  image->SetSpacing(ct.spacing_mm.data());
  image->SetOrigin(ct.origin_mm.data());
  vtkNew<vtkShortArray> values;
  values->SetArray(const_cast<short*>(ct.voxels.data()), vtkIdType(ct.voxels.size()), /*save=*/1);
  image->GetPointData()->SetScalars(values);
  return image;
}

// Both filters have the same setters but no common base that declares them.
template <class Filter>
vtkSmartPointer<vtkPolyData> contour_by(const Volume& ct, double level) {
  vtkNew<Filter> filter;
  filter->SetInputData(image_of(ct));
  filter->SetValue(0, level);
  filter->ComputeNormalsOff();
  filter->ComputeGradientsOff();
  filter->ComputeScalarsOff();
  filter->Update();
  return filter->GetOutput();
}

}  // namespace

std::size_t vtk_flying_edges_faces(const Volume& ct, double level) {
  return contour_by<vtkFlyingEdges3D>(ct, level)->GetNumberOfPolys();
}

std::size_t vtk_marching_cubes_faces(const Volume& ct, double level) {
  return contour_by<vtkMarchingCubes>(ct, level)->GetNumberOfPolys();
}

TriangleMesh vtk_marching_cubes(const Volume& ct, double level) {
  return from_polydata(*contour_by<vtkMarchingCubes>(ct, level));
}

}  // namespace organbake
