// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/cutting/edge_crossings.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Whether places lie below a skin, which may be open: then what lies behind it along the axis in
// which it is shortest counts as below.
class SkinInside {
 public:
  // The skin's points take ranks from first_rank on, and two more those that are asked about.
  SkinInside(const TriangleMesh& skin, const MaterialGrid& grid, std::uint32_t first_rank);
  bool operator()(const Eigen::Vector3d& at_mm) const;

 private:
  MaterialGrid grid_;
  std::vector<std::array<GridPoint, 3>> faces_;
  std::vector<GridBox> boxes_;
  std::uint32_t rank_;
  Eigen::Vector3d far_mm_;
};

}  // namespace organbake
