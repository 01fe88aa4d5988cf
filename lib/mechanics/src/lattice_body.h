// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Cuts the proxy's inside out of a regular lattice of cubes of `cell_mm`, five tetrahedra each: of
// these all that hold some of the inside or a proxy vertex, with the share that is inside. 0 = a
// cell of three quarters of the proxy's mean edge (some hundreds of tetrahedra in 80 faces), but
// large enough that at most about a thousand fill the body. All nodes that hold an anchor, or skin
// between three of them, are anchors, so that the proxy's own stay where they are. skin: its
// vertices, and those of its faces, that are drawn: the first ones, or all. Throws
// BadDataError for a proxy that is not closed and UsageError for cells that would be more than a
// million.
TetrahedralBody make_lattice_body(const TriangleMesh& proxy,
                                  const std::vector<std::uint32_t>& anchors, double cell_mm,
                                  const TriangleMesh& skin);
inline TetrahedralBody make_lattice_body(const TriangleMesh& proxy,
                                         const std::vector<std::uint32_t>& anchors,
                                         double cell_mm) {
  return make_lattice_body(proxy, anchors, cell_mm, proxy);
}

// In how many parts, not joined by a node, the tetrahedra fall.
std::size_t part_count(const TetrahedralBody& body);

// A regular grid of points: count per axis, the first at `first_mm`, `spacing_mm` apart.
struct SampleGrid {
  Eigen::Vector3d first_mm = Eigen::Vector3d::Zero();
  double spacing_mm = 1;
  Eigen::Vector3i count = Eigen::Vector3i::Zero();

  std::size_t size() const { return std::size_t(count.x()) * count.y() * count.z(); }
  std::size_t index(int i, int j, int k) const {
    return (std::size_t(k) * count.y() + j) * count.x() + i;
  }
};

// Which of the grid's points lie inside the mesh (1) or not (0), x fastest: the winding number
// along lines in x, so that parts may overlap and edges need not be manifold. Throws BadDataError
// for a mesh that a line leaves more or less often than it enters: one that is not closed.
std::vector<std::uint8_t> inside_samples(const TriangleMesh& mesh, const SampleGrid& grid);

}  // namespace organbake
