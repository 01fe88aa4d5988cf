// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/cut_sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace organbake {
namespace {

Eigen::Vector3d difference(const GridPoint& to, const GridPoint& from) {
  return {static_cast<double>(to.at[0] - from.at[0]), static_cast<double>(to.at[1] - from.at[1]),
          static_cast<double>(to.at[2] - from.at[2])};
}

}  // namespace

void CutSheet::add(const BladeLine& line) {
  std::array<GridPoint, BladeLine::kRows> points;
  for (int k = 0; k < BladeLine::kRows; ++k)
    points[k] = grid_.snapped(line.points_mm[k], next_rank_++);
  std::vector<BladeLine>& stroke = strokes_.back();
  stroke.push_back(line);
  const std::array<GridPoint, BladeLine::kRows> before = std::exchange(last_, points);
  if (stroke.size() < 2) return;
  const BladeLine& other = stroke[stroke.size() - 2];
  const auto strip = static_cast<std::uint32_t>(stroke.size() - 2);
  const double here = strip + 1.0;
  for (int k = 0; k + 1 < BladeLine::kRows; ++k) {
    const bool below = k == 0, above = k + 2 == BladeLine::kRows;
    const bool out = below || above || line.all_out || other.all_out;
    if (below && !line.tip_is_out && !other.tip_is_out) continue;
    if (above && !line.top_is_out && !other.top_is_out) continue;
    const double row = k;
    const auto stroke_number = static_cast<std::uint32_t>(strokes_.size() - 1);
    triangles_.push_back({{before[k], before[k + 1], points[k]},
                          stroke_number,
                          strip,
                          {{{here - 1, row}, {here - 1, row + 1}, {here, row}}},
                          out,
                          fine_mm_});
    triangles_.push_back({{points[k], before[k + 1], points[k + 1]},
                          stroke_number,
                          strip,
                          {{{here, row}, {here - 1, row + 1}, {here, row + 1}}},
                          out,
                          fine_mm_});
  }
}

Eigen::Vector3d CutSheet::at(const SheetPlace& place) const {
  const std::vector<BladeLine>& stroke = strokes_[place.stroke];
  const double last = static_cast<double>(stroke.size() - 1);
  const double line = std::clamp(place.line, 0.0, last);
  const double row = std::clamp<double>(place.row, 0, BladeLine::kRows - 1);
  const auto i = static_cast<std::size_t>(std::min(std::floor(line), std::max(0.0, last - 1)));
  const int k = std::min(static_cast<int>(row), BladeLine::kRows - 2);
  const double s = line - static_cast<double>(i), t = row - k;
  const BladeLine& a = stroke[i];
  const BladeLine& b = stroke[std::min(i + 1, stroke.size() - 1)];
  // As its two triangles have it.
  if (s + t <= 1) return (1 - s - t) * a.points_mm[k] + t * a.points_mm[k + 1] + s * b.points_mm[k];
  return (1 - t) * b.points_mm[k] + (1 - s) * a.points_mm[k + 1] + (s + t - 1) * b.points_mm[k + 1];
}

Eigen::Vector3d CutSheet::upward(const SheetPlace& place) const {
  SheetPlace up = place, down = place;
  up.row = std::min<double>(place.row + 0.5, BladeLine::kRows - 1);
  down.row = std::max(place.row - 0.5, 0.0);
  return at(up) - at(down);
}

Eigen::Vector3d CutSheet::onward(const SheetPlace& place) const {
  SheetPlace on = place, back = place;
  on.line += 0.5, back.line -= 0.5;
  return at(on) - at(back);
}

Eigen::Vector3d CutSheet::across(const SheetPlace& place) const {
  return onward(place).cross(upward(place)).normalized();
}

SheetCrossing crossing_of(const GridPoint& a, const GridPoint& b,
                          const CutSheet::Triangle& triangle) {
  const auto& [p, q, r] = triangle.corners;
  const Eigen::Vector3d way = difference(b, a), one = difference(q, p), other = difference(r, p);
  const Eigen::Vector3d normal = one.cross(other);
  const double rise = normal.dot(way);
  SheetCrossing crossing;
  // Of a segment within the plane, moved by infinitely little, the middle is as good as any.
  if (rise != 0) crossing.share = std::clamp(normal.dot(difference(p, a)) / rise, 0.0, 1.0);
  const Eigen::Vector3d at = difference(a, p) + crossing.share * way;
  const double area = normal.squaredNorm();
  double u = 1.0 / 3, v = 1.0 / 3;
  if (area > 0) {
    u = std::clamp(at.cross(other).dot(normal) / area, 0.0, 1.0);
    v = std::clamp(one.cross(at).dot(normal) / area, 0.0, 1 - u);
  }
  const auto mean = [&](int c) {
    return (1 - u - v) * triangle.places[0][c] + u * triangle.places[1][c] +
           v * triangle.places[2][c];
  };
  crossing.place = {triangle.stroke, mean(0), mean(1)};
  return crossing;
}

}  // namespace organbake
