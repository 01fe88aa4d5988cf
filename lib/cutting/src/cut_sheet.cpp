// SPDX-License-Identifier: Apache-2.0
// A blade's sheet as triangles on a grid of exact places, and where it crosses edges: by
// orientations whose sign is exact, with ties broken the same way everywhere.
#include "organbake/cutting/cut_sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

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

namespace {

Eigen::Vector3d difference(const GridPoint& to, const GridPoint& from) {
  return {static_cast<double>(to.at[0] - from.at[0]), static_cast<double>(to.at[1] - from.at[1]),
          static_cast<double>(to.at[2] - from.at[2])};
}

// The lines of a stroke that a place lies between, and its share of the way.
std::tuple<const BladeLine&, const BladeLine&, double> lines_at(
    const std::vector<BladeLine>& stroke, double line) {
  const double last = static_cast<double>(stroke.size() - 1), at = std::clamp(line, 0.0, last);
  const auto i = static_cast<std::size_t>(std::min(std::floor(at), std::max(0.0, last - 1)));
  return {stroke[i], stroke[std::min(i + 1, stroke.size() - 1)], at - static_cast<double>(i)};
}

}  // namespace

void CutSheet::add(const BladeLine& line) {
  std::array<GridPoint, BladeLine::kRows> points;
  for (int k = 0; k < BladeLine::kRows; ++k)
    points[k] = grid_.snapped(line.points_mm[k], next_rank_++);
  std::vector<BladeLine>& stroke = strokes_.back();
  stroke.push_back(line);
  stroke.back().step = step_;
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

std::size_t CutSheet::bytes() const {
  std::size_t lines = 0;
  for (const std::vector<BladeLine>& stroke : strokes_) lines += stroke.size();
  return sizeof *this + lines * sizeof(BladeLine) + triangles_.size() * sizeof(Triangle);
}

bool CutSheet::is_hole(std::uint32_t stroke) const {
  constexpr std::size_t kMostLines = 3;
  constexpr int kMiddle = BladeLine::kRows / 2;
  const std::vector<BladeLine>& lines = strokes_[stroke];
  const Eigen::Vector3d way = lines.back().points_mm[kMiddle] - lines.front().points_mm[kMiddle];
  return lines.size() <= kMostLines && way.norm() <= 2 * widths_mm_[stroke];
}

double CutSheet::step(const SheetPlace& place) const {
  const auto [a, b, s] = lines_at(strokes_[place.stroke], place.line);
  return a.step + s * (double(b.step) - a.step);
}

Eigen::Vector3d CutSheet::at(const SheetPlace& place) const {
  const auto [a, b, s] = lines_at(strokes_[place.stroke], place.line);
  const double row = std::clamp<double>(place.row, 0, BladeLine::kRows - 1);
  const int k = std::min(static_cast<int>(row), BladeLine::kRows - 2);
  const double t = row - k;
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

namespace {

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

struct Boxes {
  std::vector<GridBox> each;
  std::optional<GridBox> all;

  explicit Boxes(std::span<const CutSheet::Triangle> triangles) {
    for (const CutSheet::Triangle& triangle : triangles) {
      each.push_back(box_of(triangle));
      if (!all) all = each.back();
      all->add(each.back());
    }
  }
};

}  // namespace

void GridBox::add(const GridPoint& point) {
  for (int c = 0; c < 3; ++c) {
    low[c] = std::min(low[c], point.at[c]);
    high[c] = std::max(high[c], point.at[c]);
  }
}

void GridBox::add(const GridBox& other) {
  for (int c = 0; c < 3; ++c) {
    low[c] = std::min(low[c], other.low[c]);
    high[c] = std::max(high[c], other.high[c]);
  }
}

bool GridBox::meets(const GridBox& other) const {
  for (int c = 0; c < 3; ++c) {
    if (low[c] > other.high[c] || other.low[c] > high[c]) return false;
  }
  return true;
}

GridBox box_of(const CutSheet::Triangle& triangle) {
  GridBox box(triangle.corners[0]);
  box.add(triangle.corners[1]);
  box.add(triangle.corners[2]);
  return box;
}

double EdgeCrossings::Crossed::share() const {
  return std::clamp(0.5 * (first.share + last.share), kLeastShare, 1 - kLeastShare);
}

EdgeCrossings::EdgeCrossings(std::vector<GridPoint> points, std::vector<Edge> edges)
    : points_(std::move(points)), edges_(std::move(edges)) {
  for (Edge& edge : edges_) {
    if (edge[0] > edge[1]) std::swap(edge[0], edge[1]);
  }
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  crossed_.resize(edges_.size());
}

std::uint32_t EdgeCrossings::index_of(std::uint32_t a, std::uint32_t b) const {
  const Edge edge = {std::min(a, b), std::max(a, b)};
  return static_cast<std::uint32_t>(std::lower_bound(edges_.begin(), edges_.end(), edge) -
                                    edges_.begin());
}

std::vector<std::uint8_t> EdgeCrossings::beside_cuts() const {
  std::vector<std::uint8_t> beside(points_.size(), 0);
  for (std::size_t e = 0; e < edges_.size(); ++e)
    if (crossed_[e].cut) beside[edges_[e][0]] = beside[edges_[e][1]] = 1;
  return beside;
}

bool EdgeCrossings::cross(std::uint32_t edge, std::span<const CutSheet::Triangle> triangles,
                          std::span<const GridBox> boxes, const GridBox& all) {
  const GridPoint &a = points_[edges_[edge][0]], &b = points_[edges_[edge][1]];
  GridBox box(a);
  box.add(b);
  if (!box.meets(all)) return false;
  Crossed& crossed = crossed_[edge];
  const bool was_cut = crossed.cut;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (!box.meets(boxes[t]) || !crosses(a, b, triangles[t].corners)) continue;
    const SheetCrossing here = crossing_of(a, b, triangles[t]);
    if (!crossed.cut || here.share < crossed.first.share) crossed.first = here;
    if (!crossed.cut || here.share > crossed.last.share) crossed.last = here;
    crossed.cut = true;
  }
  return crossed.cut && !was_cut;
}

EdgeCrossings EdgeCrossings::finer(const std::vector<Eigen::Vector3d>& points_mm,
                                   const MaterialGrid& grid, std::uint32_t first_rank,
                                   std::vector<Edge> edges,
                                   std::span<const CutSheet::Triangle> taken) const {
  std::vector<GridPoint> points = points_;
  for (std::size_t p = points.size(); p < points_mm.size(); ++p)
    points.push_back(grid.snapped(points_mm[p], first_rank + static_cast<std::uint32_t>(p)));
  EdgeCrossings finer(std::move(points), std::move(edges));
  finer.keep_crossings(*this, taken);
  return finer;
}

void EdgeCrossings::keep_crossings(const EdgeCrossings& before,
                                   std::span<const CutSheet::Triangle> taken) {
  const Boxes boxes(taken);
  auto was = before.edges_.begin();
  for (std::uint32_t e = 0; e < edges_.size(); ++e) {
    while (was != before.edges_.end() && *was < edges_[e]) ++was;
    if (was != before.edges_.end() && *was == edges_[e]) {
      crossed_[e] = before.crossed_[static_cast<std::size_t>(was - before.edges_.begin())];
    } else if (boxes.all) {
      cross(e, taken, boxes.each, *boxes.all);
    }
  }
}

bool EdgeCrossings::add(std::span<const CutSheet::Triangle> triangles) {
  const Boxes boxes(triangles);
  bool more = false;
  for (std::uint32_t e = 0; boxes.all && e < edges_.size(); ++e)
    more |= cross(e, triangles, boxes.each, *boxes.all);
  return more;
}

}  // namespace organbake
