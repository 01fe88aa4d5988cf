// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The gradient F of a deformation at the vertices of a surface. It turns a vertex's normal into
// what that is now; across the normal it is the slope of a fit of second order to what has become
// of the edges that meet there, by least squares: an uneven ring of them would pass its curvature
// off as slope. Made once for the surface at rest.
class VertexGradients {
 public:
  explicit VertexGradients(const TriangleMesh& rest);

  // F − 1 at a vertex when the vertices lie at `positions` (mm) with these unit normals. To the bit
  // zero where nothing round the vertex has moved; not a number where faces without area tell none.
  Eigen::Matrix3d change(std::uint32_t vertex, const std::vector<Eigen::Vector3d>& positions,
                         const std::vector<Eigen::Vector3d>& normals) const;

 private:
  struct Spoke {
    Eigen::Vector3d edge_mm, weight;  // at rest; F = Σ (edge now)·weightᵀ + (normal now)·weightᵀ
  };
  struct Hub {
    Eigen::Vector3d normal, weight;
  };
  VertexNeighbours neighbours_;
  std::vector<std::uint32_t> first_;  // spoke of each vertex
  std::vector<Spoke> spokes_;         // in the neighbours' order
  std::vector<Hub> hubs_;
};

// Of a vertex whose gradient is not known: edges that end there stay straight.
inline Eigen::Matrix3d unknown_change() {
  return Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// Bends a face's shell matrix, flat so far, so that its edges leave the corners as the gradients
// there tell, whose changes are given by vertex:
//   S += Σ over its edges b_i b_j e_ij,   e_ij = ½ (F_i − F_j)(X_j − X_i),
// with X the corners at rest. That is exact for a deformation that is quadratic in place, nothing
// for an affine one, and the same from both faces of an edge, so that no gap opens.
void bend_face(const TriangleMesh& rest, std::uint32_t face,
               const std::vector<Eigen::Matrix3d>& changes, ShellMatrix& shell);

}  // namespace organbake
