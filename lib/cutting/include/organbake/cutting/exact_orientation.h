// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace organbake {

// A point on a grid of whole numbers, and its rank among all points that meet in a predicate: no
// two of one rank may. Ranks decide what lies exactly on something else, always the same way.
struct GridPoint {
  std::array<std::int64_t, 3> at{};
  std::uint32_t rank = 0;
};

// Steps of about a nanometre about a middle. Points beyond 2 m from it are moved to the border.
class MaterialGrid {
 public:
  MaterialGrid() = default;
  explicit MaterialGrid(const Eigen::Vector3d& middle_mm) : middle_mm_(middle_mm) {}

  GridPoint snapped(const Eigen::Vector3d& point_mm, std::uint32_t rank) const;
  Eigen::Vector3d place_mm(const GridPoint& point) const;
  // All of them, with the ranks from `first_rank` on.
  std::vector<GridPoint> snapped(const std::vector<Eigen::Vector3d>& points_mm,
                                 std::uint32_t first_rank) const;

 private:
  Eigen::Vector3d middle_mm_ = Eigen::Vector3d::Zero();
};

// Whether d lies on the side of the plane (a, b, c) from which the three run clockwise (+1), or on
// the other (−1): the sign of (b − a) × (c − a) · (d − a), exact. Where that is zero, the points
// are taken for moved by infinitely little, by their ranks (simulation of simplicity, Edelsbrunner
// & Mücke 1990), so that it never is and no two answers contradict each other.
int orientation(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d);

// Whether the segment from a to b passes through the triangle.
bool crosses(const GridPoint& a, const GridPoint& b, const std::array<GridPoint, 3>& triangle);

}  // namespace organbake
