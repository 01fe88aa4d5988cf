// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

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

}  // namespace organbake
