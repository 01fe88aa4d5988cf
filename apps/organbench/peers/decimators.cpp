// SPDX-License-Identifier: GPL-3.0-or-later
#include "peers/decimators.h"

#include <meshoptimizer.h>
#include <vtkNew.h>
#include <vtkQuadricDecimation.h>

#include "peers/vtk_mesh.h"

namespace organbake {

TriangleMesh vtk_quadric_decimation(const TriangleMesh& surface, std::size_t faces) {
  vtkNew<vtkQuadricDecimation> filter;
  filter->SetInputData(to_polydata(surface));
  filter->SetTargetReduction(1 - double(faces) / double(surface.faces.size()));
  filter->VolumePreservationOn();
  filter->Update();
  return from_polydata(*filter->GetOutput());
}

TriangleMesh meshoptimizer_simplify(const TriangleMesh& surface, std::size_t faces) {
  std::vector<float> positions;
  positions.reserve(3 * surface.vertices.size());
  for (const Eigen::Vector3d& v : surface.vertices) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(v[axis]));
  }
  std::vector<unsigned> indices;
  indices.reserve(3 * surface.faces.size());
  for (const Face& f : surface.faces) indices.insert(indices.end(), f.begin(), f.end());
  constexpr float kAnyError = 1;  // the face budget alone decides
  indices.resize(meshopt_simplify(indices.data(), indices.data(), indices.size(), positions.data(),
                                  surface.vertices.size(), 3 * sizeof(float), 3 * faces,
                                  kAnyError));
  TriangleMesh mesh;
  std::vector<std::uint32_t> renamed(surface.vertices.size(), ~std::uint32_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    std::uint32_t& name = renamed[indices[i]];
    if (name == ~std::uint32_t{0}) {
      name = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(surface.vertices[indices[i]]);
    }
    if (i % 3 == 0) mesh.faces.push_back({});
    mesh.faces.back()[i % 3] = name;
  }
  return mesh;
}

}  // namespace organbake
