// SPDX-License-Identifier: Apache-2.0
#include "sheet_neighbourhood.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace organbake {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr double kRoundSheet_mm = 2;  // a sheet's end opens from a little before it

}  // namespace

SheetNeighbourhood::SheetNeighbourhood(const MaterialGrid& grid,
                                       std::span<const CutSheet::Triangle> triangles) {
  for (const CutSheet::Triangle& triangle : triangles) {
    if (triangle.farther_out) continue;
    Near near;
    for (int k = 0; k < 3; ++k) near.corners[k] = grid.place_mm(triangle.corners[k]);
    for (const Eigen::Vector3d& corner : near.corners) near.box.add(corner);
    near.fine_mm = triangle.fine_mm;
    const double round_mm = std::min(kRoundSheet_mm, near.fine_mm);
    near.box.min.array() -= round_mm, near.box.max.array() += round_mm;
    near.normal = (near.corners[1] - near.corners[0])
                      .cross(near.corners[2] - near.corners[0])
                      .stableNormalized();
    all_.add(near.box.min), all_.add(near.box.max);
    near_.push_back(near);
  }
}

bool SheetNeighbourhood::meets(std::span<const Eigen::Vector3d> corners_mm) const {
  return fine_mm(corners_mm) < kNowhere;
}

double SheetNeighbourhood::fine_mm(std::span<const Eigen::Vector3d> corners_mm) const {
  Bounds box;
  for (const Eigen::Vector3d& corner : corners_mm) box.add(corner);
  double finest = kNowhere;
  if (!box.meets(all_)) return finest;
  for (const Near& near : near_) {
    if (near.fine_mm >= finest || !box.meets(near.box)) continue;
    double low = kNowhere, high = -kNowhere;
    for (const Eigen::Vector3d& corner : corners_mm) {
      const double away = near.normal.dot(corner - near.corners[0]);
      low = std::min(low, away), high = std::max(high, away);
    }
    if (low <= 0 && high >= 0) finest = near.fine_mm;
  }
  return finest;
}

}  // namespace organbake
