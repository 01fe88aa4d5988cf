// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tetrahedra and skin made finer beside a sheet.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A sheet's triangles in tissue, asked of cells that may lie near.
class SheetNeighbourhood {
 public:
  SheetNeighbourhood(const MaterialGrid& grid, std::span<const CutSheet::Triangle> triangles);

  bool empty() const { return near_.empty(); }
  // Whether a triangle passes through the box about a cell's corners, or a little beside it, and
  // its plane between them.
  bool meets(std::span<const Eigen::Vector3d> corners_mm) const;
  // How fine the skin is to be there, mm; infinity where no triangle is near.
  double fine_mm(std::span<const Eigen::Vector3d> corners_mm) const;

 private:
  struct Near {
    std::array<Eigen::Vector3d, 3> corners;
    Eigen::Vector3d normal;
    Bounds box;
    double fine_mm;
  };
  std::vector<Near> near_;
  Bounds all_;
};

// What has become of a mesh whose cells, triangles or tetrahedra, were made finer.
struct Bisection {
  // Of each node that came to it, behind those that it had: the ends of the edge that it halves.
  std::vector<std::array<std::uint32_t, 2>> halved;
  // Of each cell the one that it is part of, by its number before.
  std::vector<std::uint32_t> part_of;

  bool none() const { return halved.empty(); }
};

// Halves the longest edges of cells, with all that lie round them, until none is coarse:
// is_coarse(c) for the number of one of the mesh's as it is then. Neighbours whose own longest edge
// is another are halved there first, so that cells match and no shape gets worse without end
// (Rivara 1984). One of the halves keeps the cell's number.
Bisection bisect(TriangleMesh& mesh, const std::function<bool(std::uint32_t)>& is_coarse);
// Where both ends of an edge are anchors, its middle is one. Parts keep the whole's fill; embedded
// vertices are dropped.
Bisection bisect(TetrahedralBody& body, const std::function<bool(std::uint32_t)>& is_coarse);

// mm, of the longest of a cell's edges.
double longest_edge_mm(const TriangleMesh& mesh, const Face& face);
double longest_edge_mm(const TetrahedralBody& body, const Tetrahedron& tetrahedron);

}  // namespace organbake
