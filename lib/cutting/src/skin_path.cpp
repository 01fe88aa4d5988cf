// SPDX-License-Identifier: Apache-2.0
// A cut's border within a face follows the blade's way, with no more corners than its shape needs
// (Douglas & Peucker 1973): each is a vertex that has to be carried from then on.
#include "skin_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

namespace organbake {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

// Where a line of a stroke passes through a face.
std::optional<PathPoint> pierced(const Corners& face, const BladeLine& line, std::uint32_t stroke,
                                 double number) {
  const Eigen::Vector3d one = face[1] - face[0], other = face[2] - face[0];
  const Eigen::Vector3d normal = one.cross(other);
  for (int k = 0; k + 1 < BladeLine::kRows; ++k) {
    const Eigen::Vector3d way = line.points_mm[k + 1] - line.points_mm[k];
    const double rise = normal.dot(way);
    if (rise == 0) continue;
    const double share = normal.dot(face[0] - line.points_mm[k]) / rise;
    if (!(share >= 0 && share <= 1)) continue;
    const Eigen::Vector3d at = line.points_mm[k] + share * way - face[0];
    const Eigen::Vector2d b(at.cross(other).dot(normal) / normal.squaredNorm(),
                            one.cross(at).dot(normal) / normal.squaredNorm());
    if (b.x() > 0 && b.y() > 0 && b.sum() < 1) return PathPoint{b, {stroke, number, k + share}};
  }
  return std::nullopt;
}

// Douglas & Peucker 1973, on the points between the ends of `path`.
void simplify(const std::vector<Eigen::Vector3d>& path, std::size_t first, std::size_t last,
              double within_mm, std::vector<std::uint8_t>& keep) {
  if (last - first < 2) return;
  const Eigen::Vector3d way = path[last] - path[first];
  double farthest = within_mm;
  std::size_t most = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const Eigen::Vector3d at = path[i] - path[first];
    const double share =
        way.squaredNorm() > 0 ? std::clamp(at.dot(way) / way.squaredNorm(), 0.0, 1.0) : 0;
    const double away = (at - share * way).norm();
    if (away > farthest) farthest = away, most = i;
  }
  if (most == first) return;
  keep[most] = 1;
  simplify(path, first, most, within_mm, keep);
  simplify(path, most, last, within_mm, keep);
}

}  // namespace

std::vector<PathPoint> path_within(const Corners& face, const PathPoint& from, const PathPoint& to,
                                   const CutSheet& sheet, double within_mm) {
  if (from.place.stroke != to.place.stroke) return {};
  const std::vector<BladeLine>& stroke = sheet.strokes()[from.place.stroke];
  const double low = std::min(from.place.line, to.place.line);
  const double high = std::max(from.place.line, to.place.line);
  std::vector<PathPoint> points = {from};
  for (auto i = static_cast<std::size_t>(std::floor(low)) + 1;
       i < stroke.size() && static_cast<double>(i) < high; ++i) {
    const auto point = pierced(face, stroke[i], from.place.stroke, static_cast<double>(i));
    if (point) points.push_back(*point);
  }
  points.push_back(to);
  if (from.place.line > to.place.line) std::reverse(points.begin() + 1, points.end() - 1);
  std::vector<Eigen::Vector3d> path;
  for (const PathPoint& p : points) {
    path.push_back(face[0] + p.in_face.x() * (face[1] - face[0]) +
                   p.in_face.y() * (face[2] - face[0]));
  }
  std::vector<std::uint8_t> keep(points.size(), 0);
  simplify(path, 0, points.size() - 1, within_mm, keep);
  std::vector<PathPoint> kept;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    if (keep[i]) kept.push_back(points[i]);
  }
  return kept;
}

}  // namespace organbake
