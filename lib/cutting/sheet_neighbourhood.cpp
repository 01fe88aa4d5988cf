// SPDX-License-Identifier: Apache-2.0
#include "cutting/sheet_neighbourhood.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace organbake {
namespace {

constexpr double kRoundSheet_mm = 2;  // a sheet's end opens from a little before it

void widen(Bounds& box, const Eigen::Vector3d& point_mm) {
  box.min = box.min.cwiseMin(point_mm);
  box.max = box.max.cwiseMax(point_mm);
}

bool overlap(const Bounds& a, const Bounds& b) {
  return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

}  // namespace

SheetNeighbourhood::SheetNeighbourhood(const MaterialGrid& grid,
                                       std::span<const CutSheet::Triangle> triangles) {
  for (const CutSheet::Triangle& triangle : triangles) {
    if (triangle.farther_out) continue;
    Near near;
    for (int k = 0; k < 3; ++k) near.corners[k] = grid.place_mm(triangle.corners[k]);
    for (const Eigen::Vector3d& corner : near.corners) widen(near.box, corner);
    near.box.min.array() -= kRoundSheet_mm, near.box.max.array() += kRoundSheet_mm;
    near.normal = (near.corners[1] - near.corners[0])
                      .cross(near.corners[2] - near.corners[0])
                      .stableNormalized();
    widen(all_, near.box.min), widen(all_, near.box.max);
    near_.push_back(near);
  }
}

bool SheetNeighbourhood::meets(std::span<const Eigen::Vector3d> corners_mm) const {
  Bounds box;
  for (const Eigen::Vector3d& corner : corners_mm) widen(box, corner);
  if (!overlap(box, all_)) return false;
  return std::any_of(near_.begin(), near_.end(), [&](const Near& near) {
    if (!overlap(box, near.box)) return false;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Eigen::Vector3d& corner : corners_mm) {
      const double away = near.normal.dot(corner - near.corners[0]);
      low = std::min(low, away), high = std::max(high, away);
    }
    return low <= 0 && high >= 0;
  });
}

}  // namespace organbake
