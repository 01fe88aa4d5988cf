// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/geometry/written_color.h"

namespace organbake {

// The corners of each cell of a VTK data set.
class VtkCells {
 public:
  VtkCells() = default;
  // `ends`: where in the list of `corners` each cell ends. Throws BadDataError with `name` for an
  // end outside the list and for a corner that is none of `points`.
  VtkCells(const std::vector<double>& ends, const std::vector<double>& corners, std::size_t points,
           const std::string& name);

  std::size_t size() const { return ends_.size(); }
  std::span<const std::uint32_t> operator[](std::size_t cell) const {
    const std::size_t begin = cell == 0 ? 0 : ends_[cell - 1];
    return std::span(corners_).subspan(begin, ends_[cell] - begin);
  }

 private:
  std::vector<std::uint32_t> corners_;
  std::vector<std::size_t> ends_;
};

// Colours as a file has them, of its points or its cells; empty: there are none.
struct VtkColors {
  std::vector<Eigen::Vector3d> written;
  ColorScale scale = ColorScale::number;
};

// What a data set of VTK holds of a surface.
struct VtkSurface {
  std::vector<Eigen::Vector3d> points;
  VtkColors point_colors, cell_colors;  // those of points go before
};

// The triangles of polygons and strips. The colours of cells begin with those of
// `cells_before` that are no faces.
TriangleMesh triangles_of(const VtkSurface& surface, const VtkCells& polygons,
                          const VtkCells& strips, std::size_t cells_before,
                          const std::string& name);

// The outside of an unstructured grid: of solid cells the faces that one of them alone has, and all
// flat cells that are no faces of solids; points inside go. `kinds` are VTK's numbers. Curved cells
// are cut through the middles of their edges. Throws BadDataError with `name` for a kind that is
// not read (polyhedra, cells of higher order) and for a cell that has not its kind's corners.
TriangleMesh outside_of(const VtkSurface& surface, const VtkCells& cells,
                        const std::vector<double>& kinds, const std::string& name);

}  // namespace organbake
