// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <queue>
#include <tuple>
#include <utility>

#include "organbake/cutting/cut_skin.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Widths of a cut from its lips within which the skin gives way: it is compressed to three quarters
// of what it was.
constexpr double kReach = 2;

}  // namespace

// By half a cut's width, square to its border along the skin; where its lips hang together, not.
void CutSkin::draw_lips_back(const CutSheet& sheet) {
  struct Pull {
    Vector3d back = Vector3d::Zero();
    double half_mm = 0;
  };
  std::map<std::uint32_t, Pull> pulls;  // by vertex
  for (const SkinBorder& border : borders_) {
    const double half = 0.5 * sheet.width_mm(vertices_[border.left[0]].place.stroke);
    const Vector3d along = vertices_[border.left[1]].at_mm - vertices_[border.left[0]].at_mm;
    const Vector3d to_left = normal_beside(border).cross(along).stableNormalized();
    for (int end = 0; half > 0 && end < 2; ++end) {
      if (border.left[end] == border.right[end]) continue;
      for (const auto& [lip, side] :
           {std::pair(border.left[end], 1.0), std::pair(border.right[end], -1.0)}) {
        Pull& pull = pulls[lip];
        pull.back += side * to_left;
        pull.half_mm = std::max(pull.half_mm, half);
      }
    }
  }
  // Two pieces of border meet at a lip, and say much the same.
  for (const auto& [lip, pull] : pulls)
    vertices_[lip].drawn_back_mm = pull.half_mm * pull.back.stableNormalized();
}

// Skin beside a lip goes with it the less the farther off it is, along its edges (Dijkstra 1959):
// what lies across a cut is not near.
void CutSkin::draw_skin_back() {
  std::map<std::uint32_t, std::vector<std::uint32_t>> beside;
  for (const SkinPart& part : parts_) {
    for (int k = 0; k < 3; ++k) {
      beside[part.corners[k]].push_back(part.corners[(k + 1) % 3]);
      beside[part.corners[(k + 1) % 3]].push_back(part.corners[k]);
    }
  }
  using Reached = std::tuple<double, std::uint32_t, std::uint32_t>;  // mm away, vertex, from a lip
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  for (std::uint32_t v = 0; v < vertices_.size(); ++v)
    if (vertices_[v].on_border) next.emplace(0, v, v);
  std::vector<std::uint8_t> done(vertices_.size(), 0);
  while (!next.empty()) {
    const auto [away, v, lip] = next.top();
    next.pop();
    const double reach = 2 * kReach * vertices_[lip].drawn_back_mm.norm();
    if (std::exchange(done[v], 1) || (v != lip && away >= reach)) continue;
    if (v != lip) vertices_[v].drawn_back_mm = (1 - away / reach) * vertices_[lip].drawn_back_mm;
    for (const std::uint32_t n : beside[v])
      if (!done[n]) next.emplace(away + (vertices_[n].at_mm - vertices_[v].at_mm).norm(), n, lip);
  }
}

void CutSkin::draw_back(const CutSheet& sheet) {
  draw_lips_back(sheet);
  if (std::all_of(vertices_.begin(), vertices_.end(),
                  [](const Vertex& v) { return v.drawn_back_mm.isZero(0); }))
    return;
  draw_skin_back();
  for (Vertex& vertex : vertices_)
    vertex.at_mm += vertex.drawn_back_mm, vertex.side_mm += vertex.drawn_back_mm;
}

}  // namespace organbake
