// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/skin_inside.h"

namespace organbake {

SkinInside::SkinInside(const TriangleMesh& skin, const MaterialGrid& grid, std::uint32_t first_rank)
    : grid_(grid), rank_(first_rank + static_cast<std::uint32_t>(skin.vertices.size())) {
  const std::vector<GridPoint> points = grid.snapped(skin.vertices, first_rank);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t f = 0; f < skin.faces.size(); ++f) {
    const auto& [a, b, c] = skin.faces[f];
    faces_.push_back({points[a], points[b], points[c]});
    boxes_.emplace_back(points[a]);
    boxes_.back().add(points[b]);
    boxes_.back().add(points[c]);
    sum += face_area(skin, f) * face_normal(skin, f);
  }
  // A closed skin's normals sum up to nothing, and any way out is as good; an open one is left
  // through its front.
  const Bounds box = bounds(skin);
  int axis = 0;
  sum.cwiseAbs().maxCoeff(&axis);
  far_mm_ = Eigen::Vector3d::Zero();
  far_mm_[axis] = (sum[axis] < 0 ? -2 : 2) * box.diagonal();
}

bool SkinInside::operator()(const Eigen::Vector3d& at_mm) const {
  const GridPoint from = grid_.snapped(at_mm, rank_);
  const GridPoint to = grid_.snapped(at_mm + far_mm_, rank_ + 1);
  GridBox box(from);
  box.add(to);
  bool inside = false;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (boxes_[f].meets(box) && crosses(from, to, faces_[f])) inside = !inside;
  }
  return inside;
}

}  // namespace organbake
