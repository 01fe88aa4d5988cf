// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The polyhedron { x : directions_i · x ≤ 1 } ∩ [−box, box]³.
struct PlanePolyhedron {
  struct Vertex {
    Eigen::Vector3d position;
    std::vector<std::uint32_t> planes;  // of the directions through it, increasing
    bool on_box = false;
  };
  std::vector<Vertex> vertices;
  TriangleMesh surface;  // outward, facets fanned
};

// Exact in what meets where (CGAL); vertices in the order of their places. The box is a power of
// two above 1: its inverse is then exact, too.
PlanePolyhedron intersect_view_planes(const std::vector<Eigen::Vector3d>& directions, double box);

}  // namespace organbake
