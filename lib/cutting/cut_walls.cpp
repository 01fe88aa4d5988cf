// SPDX-License-Identifier: Apache-2.0
#include "cutting/cut_walls.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kDown = 4;            // quadrangles from the lips to the bottom
constexpr double kAside_mm = 0.05;  // from the cut into the tissue
constexpr double kFarAside_mm = 0.5;
constexpr double kFarthestEnd_mm = 12;  // of a cut's end from where its lips come together
constexpr double kBelowSkin_mm = 1.5;
constexpr double kAlongEdge = 1e-3;   // sine of the angle between the blade's edge and the skin
constexpr double kFarthestLines = 2;  // of a stroke: who left it farther away tells nothing

class WallMaker {
 public:
  WallMaker(const CutSkin& skin, const CutSheet& sheet) : skin_(skin), sheet_(sheet) {}

  CutWalls make() {
    for (const SkinBorder& border : skin_.borders()) {
      if (entry(border) < -kAlongEdge)
        leaving_.push_back({vertex(border.left[0]).place, vertex(border.left[1]).place});
    }
    for (const SkinBorder& border : skin_.borders()) {
      if (!(entry(border) > kAlongEdge)) continue;
      const Vector3d outward = outward_from_left(border);
      const Column *const from = &column(border.left[0], outward), *const to = &column(
                                                                       border.left[1], outward);
      const Column *const back_from = &column(border.right[1], -outward), *const back_to = &column(
                                                                              border.right[0],
                                                                              -outward);
      add_wall(*from, *to);
      add_wall(*back_from, *back_to);
      if (border.left[0] == border.right[0]) add_end(border, 0, outward, *from, *back_to);
      if (border.left[1] == border.right[1]) add_end(border, 1, outward, *to, *back_from);
    }
    return std::move(walls_);
  }

 private:
  using Column = std::array<std::uint32_t, kDown + 1>;

  const CutSkin::Vertex& vertex(std::uint32_t v) const { return skin_.vertices()[v]; }

  Vector3d normal_of(const SkinBorder& border) const {
    const auto& [a, b, c] = skin_.parts()[border.face].corners;
    return (vertex(b).at_mm - vertex(a).at_mm)
        .cross(vertex(c).at_mm - vertex(a).at_mm)
        .stableNormalized();
  }

  // How the blade's edge stands on the skin: 1 where it came in square, −1 where it left; next to
  // nothing where the border runs along the edge.
  double entry(const SkinBorder& border) const {
    const Vector3d up = sheet_.upward(vertex(border.left[0]).place);
    return up.normalized().dot(normal_of(border));
  }

  // Across the sheet, away from the tissue on the border's left.
  Vector3d outward_from_left(const SkinBorder& border) const {
    const Vector3d across = sheet_.across(vertex(border.left[0]).place);
    // The left part lies on the left of its border, seen from outside.
    const Vector3d along = vertex(border.left[1]).at_mm - vertex(border.left[0]).at_mm;
    const Vector3d to_left = normal_of(border).cross(along);
    return to_left.dot(across) < 0 ? across : Vector3d(-across);
  }

  // The row at which the blade's edge ends, or leaves the tissue, below a place.
  double bottom_row(const SheetPlace& place) const {
    double row = 1, nearest = kFarthestLines;
    for (const auto& [a, b] : leaving_) {
      if (a.stroke != place.stroke || b.stroke != place.stroke) continue;
      const double low = std::min(a.line, b.line), high = std::max(a.line, b.line);
      const double away = std::max({low - place.line, place.line - high, 0.0});
      const double share =
          high > low ? std::clamp((place.line - a.line) / (b.line - a.line), 0.0, 1.0) : 0.5;
      const double there = a.row + share * (b.row - a.row);
      if (there >= place.row || away > nearest || (away == nearest && there <= row)) continue;
      nearest = away, row = there;
    }
    return std::min(row, place.row);
  }

  const Column& column(std::uint32_t lip, const Vector3d& outward) {
    const auto [at, made] = columns_.try_emplace(lip);
    if (!made) return at->second;
    const SheetPlace& place = vertex(lip).place;
    const double bottom = bottom_row(place);
    for (int k = 0; k <= kDown; ++k) {
      // Where cuts cross, the lip tells better than the wall where its tissue lies.
      const Vector3d of_lip = vertex(lip).side_mm - vertex(lip).at_mm;
      const Vector3d aside = k == 0 || of_lip.norm() > kFarAside_mm ? of_lip : -kAside_mm * outward;
      SheetPlace here = place;
      here.row += (bottom - place.row) * k / kDown;
      CutWalls::Vertex made_here;
      made_here.lip = lip;
      const double half_mm = 0.5 * sheet_.width_mm(place.stroke);
      made_here.at_mm = k == 0 ? vertex(lip).at_mm : sheet_.at(here) - half_mm * outward;
      made_here.side_mm = made_here.at_mm + aside;
      at->second[k] = static_cast<std::uint32_t>(walls_.vertices.size());
      walls_.vertices.push_back(made_here);
    }
    return at->second;
  }

  // Between two columns, below a border that runs with its tissue to the left.
  void add_wall(const Column& a, const Column& b) {
    for (int k = 0; k < kDown; ++k) {
      walls_.faces.push_back({a[k + 1], b[k + 1], b[k]});
      walls_.faces.push_back({a[k + 1], b[k], a[k]});
    }
  }

  // Below the skin that holds together at a border's end the cut goes on.
  void add_end(const SkinBorder& border, int end, const Vector3d& outward, const Column& left,
               const Column& right) {
    const SheetPlace& place = vertex(border.left[end]).place;
    const SheetPlace& other = vertex(border.left[1 - end]).place;
    if (other.stroke != place.stroke || other.line == place.line) return;
    const Vector3d here = sheet_.at(place);
    const double last = static_cast<double>(sheet_.strokes()[place.stroke].size() - 1);
    const double step = place.line > other.line ? 1 : -1;
    SheetPlace beyond = place;
    while (beyond.line + step >= 0 && beyond.line + step <= last &&
           (sheet_.at(beyond) - here).norm() < kFarthestEnd_mm)
      beyond.line += step;
    const double per_row = sheet_.upward(beyond).norm();
    if (per_row > 0) beyond.row -= kBelowSkin_mm / per_row;
    const double bottom = std::min(bottom_row(place), beyond.row);
    std::array<Column, 2> ends;
    for (int side = 0; side < 2; ++side) {
      for (int k = 0; k <= kDown; ++k) {
        SheetPlace at = beyond;
        at.row += (bottom - beyond.row) * k / kDown;
        ends[side][k] = static_cast<std::uint32_t>(walls_.vertices.size());
        const Vector3d point = sheet_.at(at);
        walls_.vertices.push_back({point, point + (side == 0 ? -kAside_mm : kAside_mm) * outward,
                                   side == 0 ? border.left[end] : border.right[end]});
      }
    }
    if (end == 1) {
      add_wall(left, ends[0]), add_wall(ends[1], right);
    } else {
      add_wall(ends[0], left), add_wall(right, ends[1]);
    }
  }

  const CutSkin& skin_;
  const CutSheet& sheet_;
  std::vector<std::array<SheetPlace, 2>> leaving_;  // borders along which blades left the tissue
  std::map<std::uint32_t, Column> columns_;
  CutWalls walls_;
};

}  // namespace

CutWalls cut_walls(const CutSkin& skin, const CutSheet& sheet) {
  return WallMaker(skin, sheet).make();
}

}  // namespace organbake
