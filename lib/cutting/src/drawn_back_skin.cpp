// SPDX-License-Identifier: Apache-2.0
// What a wide blade takes away is not carved out of the tetrahedra: the lips are drawn back by half
// the width each instead, and the skin beside them gives way, so no new elements are needed.
#include "drawn_back_skin.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <queue>
#include <tuple>
#include <utility>

namespace organbake {
namespace {

using Eigen::Vector3d;

// Widths of a cut from its lips within which the skin gives way: it is compressed to three quarters
// of what it was.
constexpr double kReach = 2;

using Vertices = std::vector<CutSkin::Vertex>;

// By half a cut's width, square to its border along the skin; where its lips hang together, not.
void draw_lips_back(const CutSkin& skin, const CutSheet& sheet, Vertices& vertices) {
  struct Pull {
    Vector3d back = Vector3d::Zero();
    double half_mm = 0;
  };
  std::map<std::uint32_t, Pull> pulls;  // by vertex
  for (const SkinBorder& border : skin.borders()) {
    const double half = 0.5 * sheet.width_mm(vertices[border.left[0]].place.stroke);
    const Vector3d along = vertices[border.left[1]].at_mm - vertices[border.left[0]].at_mm;
    const Vector3d to_left = skin.normal_beside(border).cross(along).stableNormalized();
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
    vertices[lip].drawn_back_mm = pull.half_mm * pull.back.stableNormalized();
}

// Skin beside a lip goes with it the less the farther off it is, along its edges (Dijkstra 1959):
// what lies across a cut is not near.
void draw_beside_back(const std::vector<SkinPart>& parts, Vertices& vertices) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> beside;
  for (const SkinPart& part : parts) {
    for (int k = 0; k < 3; ++k) {
      beside[part.corners[k]].push_back(part.corners[(k + 1) % 3]);
      beside[part.corners[(k + 1) % 3]].push_back(part.corners[k]);
    }
  }
  using Reached = std::tuple<double, std::uint32_t, std::uint32_t>;  // mm away, vertex, from a lip
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  for (std::uint32_t v = 0; v < vertices.size(); ++v)
    if (vertices[v].on_border) next.emplace(0, v, v);
  std::vector<std::uint8_t> done(vertices.size(), 0);
  while (!next.empty()) {
    const auto [away, v, lip] = next.top();
    next.pop();
    const double reach = 2 * kReach * vertices[lip].drawn_back_mm.norm();
    if (std::exchange(done[v], 1) || (v != lip && away >= reach)) continue;
    if (v != lip) vertices[v].drawn_back_mm = (1 - away / reach) * vertices[lip].drawn_back_mm;
    for (const std::uint32_t n : beside[v])
      if (!done[n]) next.emplace(away + (vertices[n].at_mm - vertices[v].at_mm).norm(), n, lip);
  }
}

}  // namespace

void draw_skin_back(const CutSkin& skin, const CutSheet& sheet, Vertices& vertices) {
  draw_lips_back(skin, sheet, vertices);
  if (std::all_of(vertices.begin(), vertices.end(),
                  [](const CutSkin::Vertex& v) { return v.drawn_back_mm.isZero(0); }))
    return;
  draw_beside_back(skin.parts(), vertices);
  for (CutSkin::Vertex& vertex : vertices)
    vertex.at_mm += vertex.drawn_back_mm, vertex.side_mm += vertex.drawn_back_mm;
}

}  // namespace organbake
