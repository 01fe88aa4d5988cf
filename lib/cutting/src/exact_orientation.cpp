// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/exact_orientation.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace organbake {
namespace {

__extension__ using Wide = __int128;

constexpr double kStepsPerMm = 1 << 20;
constexpr double kFarthest = 2147483648.0;  // steps: the products of three differences fit in Wide

using Row = std::array<std::int64_t, 4>;
using Square = std::array<Row, 4>;

Wide determinant(const Square& m) {
  const auto two = [&](int a, int b, int r) { return Wide(m[r][a]) * m[r + 1][b]; };
  // Laplace's expansion along the first and the last two rows.
  const auto pair = [&](int a, int b, int r) { return two(a, b, r) - two(b, a, r); };
  // Products of two pairs would not fit: the fourth column holds 0 or 1, so one of each two pairs
  // is small, or both are.
  return pair(0, 1, 0) * pair(2, 3, 2) - pair(0, 2, 0) * pair(1, 3, 2) +
         pair(0, 3, 0) * pair(1, 2, 2) + pair(1, 2, 0) * pair(0, 3, 2) -
         pair(1, 3, 0) * pair(0, 2, 2) + pair(2, 3, 0) * pair(0, 1, 2);
}

// Which row moves along which column, as bits 3 · row + column; at most one of each row and column.
std::vector<std::uint32_t> moves_by_size() {
  std::vector<std::uint32_t> moves;
  for (std::uint32_t bits = 0; bits < 1u << 12; ++bits) {
    std::array<int, 4> rows{};
    std::array<int, 3> columns{};
    bool fits = true;
    for (int b = 0; b < 12; ++b) {
      if (bits >> b & 1) fits = fits && ++rows[b / 3] == 1 && ++columns[b % 3] == 1;
    }
    if (fits) moves.push_back(bits);
  }
  return moves;  // the smaller the number, the larger the move
}

Wide coefficient(const std::array<const GridPoint*, 4>& points, std::uint32_t moves) {
  Square rows;
  for (int r = 0; r < 4; ++r) {
    const auto& at = points[r]->at;
    rows[r] = {at[0], at[1], at[2], 1};
    for (int c = 0; c < 3; ++c) {
      if (moves >> (3 * r + c) & 1) rows[r] = {c == 0, c == 1, c == 2, 0};
    }
  }
  return determinant(rows);
}

int perturbed(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  static const std::vector<std::uint32_t> moves = moves_by_size();
  std::array<const GridPoint*, 4> points = {&a, &b, &c, &d};
  int sign = -1;  // det of rows (p, 1) is −(b − a) × (c − a) · (d − a)
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k + 1 < 4 - i; ++k) {
      if (points[k]->rank > points[k + 1]->rank) std::swap(points[k], points[k + 1]), sign = -sign;
    }
  }
  for (const std::uint32_t move : moves) {
    const Wide value = coefficient(points, move);
    if (value != 0) return value > 0 ? sign : -sign;
  }
  return 1;  // of points of one rank alone
}

}  // namespace

GridPoint MaterialGrid::snapped(const Eigen::Vector3d& point_mm, std::uint32_t rank) const {
  GridPoint point;
  point.rank = rank;
  for (int c = 0; c < 3; ++c) {
    const double steps = std::round((point_mm[c] - middle_mm_[c]) * kStepsPerMm);
    // Written so that NaN goes to the border, too.
    point.at[c] = static_cast<std::int64_t>(
        steps < kFarthest ? (steps > -kFarthest ? steps : -kFarthest) : kFarthest);
  }
  return point;
}

Eigen::Vector3d MaterialGrid::place_mm(const GridPoint& point) const {
  return middle_mm_ + Eigen::Vector3d(static_cast<double>(point.at[0]),
                                      static_cast<double>(point.at[1]),
                                      static_cast<double>(point.at[2])) /
                          kStepsPerMm;
}

std::vector<GridPoint> MaterialGrid::snapped(const std::vector<Eigen::Vector3d>& points_mm,
                                             std::uint32_t first_rank) const {
  std::vector<GridPoint> points;
  points.reserve(points_mm.size());
  for (const Eigen::Vector3d& point : points_mm) points.push_back(snapped(point, first_rank++));
  return points;
}

int orientation(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  // Differences are exact in double precision; the bound is that of the products and sums.
  double u[3], v[3], w[3];
  for (int k = 0; k < 3; ++k) {
    u[k] = static_cast<double>(b.at[k] - a.at[k]);
    v[k] = static_cast<double>(c.at[k] - a.at[k]);
    w[k] = static_cast<double>(d.at[k] - a.at[k]);
  }
  const double xy = u[0] * v[1], yx = u[1] * v[0], yz = u[1] * v[2], zy = u[2] * v[1],
               zx = u[2] * v[0], xz = u[0] * v[2];
  const double sum = (yz - zy) * w[0] + (zx - xz) * w[1] + (xy - yx) * w[2];
  const double size = (std::abs(yz) + std::abs(zy)) * std::abs(w[0]) +
                      (std::abs(zx) + std::abs(xz)) * std::abs(w[1]) +
                      (std::abs(xy) + std::abs(yx)) * std::abs(w[2]);
  constexpr double kRounding = 1e-15;
  if (std::abs(sum) > kRounding * size) return sum > 0 ? 1 : -1;
  return perturbed(a, b, c, d);
}

bool crosses(const GridPoint& a, const GridPoint& b, const std::array<GridPoint, 3>& triangle) {
  const auto& [p, q, r] = triangle;
  if (orientation(p, q, r, a) == orientation(p, q, r, b)) return false;
  const int first = orientation(a, b, p, q);
  return first == orientation(a, b, q, r) && first == orientation(a, b, r, p);
}

}  // namespace organbake
