// SPDX-License-Identifier: Apache-2.0
// A crack in a stretched sheet opens as an ellipse (Inglis 1913): with the root of the distance
// from its tip, and the wider the longer it is. Skin on tissue holds on to that: over a few
// millimetres it is free to slip (kFree_mm), and a longer cut is no wider in its middle. So is the
// gape of a lip the widest times the root of its distance from the nearest end of the cut, along
// it, over kFree_mm, one at most. With a capsule or serosa stretched by some 5 to 10 % that is
// free over ten millimetres or so across a cut, the widest comes to about a millimetre; fresh cuts
// of liver and bowel that nobody pulls on gape by one half to two: the widest is the tissue's own
// (MechanicsModel::cut_gape_mm).
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

#include "organbake/cutting/cut_skin.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kFree_mm = 4;
constexpr double kGiveWay = 4;  // half gapes from a lip within which the skin beside it gives way

using Neighbours = std::map<std::uint32_t, std::vector<std::uint32_t>>;
constexpr double kFar = std::numeric_limits<double>::infinity();

void join(std::uint32_t a, std::uint32_t b, Neighbours& neighbours) {
  neighbours[a].push_back(b);
  neighbours[b].push_back(a);
}

// From each vertex the way (mm) to the nearest source, and that (Dijkstra 1959): on from vertices
// that lie within a source's reach_mm(source) of it.
struct Reached {
  double mm = kFar;
  std::uint32_t source = 0;
};
template <class Reach>
std::map<std::uint32_t, Reached> ways_from(const std::vector<std::uint32_t>& sources,
                                           const Neighbours& neighbours,
                                           const std::vector<CutSkin::Vertex>& vertices,
                                           const Reach& reach_mm) {
  std::map<std::uint32_t, Reached> reached;
  using Next = std::tuple<double, std::uint32_t, std::uint32_t>;
  std::priority_queue<Next, std::vector<Next>, std::greater<>> next;
  for (const std::uint32_t source : sources) next.emplace(0, source, source);
  while (!next.empty()) {
    const auto [mm, vertex, source] = next.top();
    next.pop();
    if (!reached.try_emplace(vertex, Reached{mm, source}).second) continue;
    if (vertex != source && mm >= reach_mm(source)) continue;
    const auto beside = neighbours.find(vertex);
    if (beside == neighbours.end()) continue;
    for (const std::uint32_t n : beside->second)
      if (!reached.contains(n))
        next.emplace(mm + (vertices[n].at_mm - vertices[vertex].at_mm).norm(), n, source);
  }
  return reached;
}

Neighbours neighbours_on(const std::vector<SkinPart>& parts) {
  Neighbours neighbours;
  for (const SkinPart& part : parts)
    for (int k = 0; k < 3; ++k) join(part.corners[k], part.corners[(k + 1) % 3], neighbours);
  return neighbours;
}

}  // namespace

LipGape::LipGape(const CutSkin& skin, std::span<const Wall> walls, double widest_mm) {
  find_lips(skin, widest_mm);
  std::map<std::uint32_t, std::size_t> number;
  for (std::size_t l = 0; l < lips_.size(); ++l) number[lips_[l].vertex] = l;
  find_beside(skin, widest_mm);
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const auto lip = number.find(walls[w].lip);
    if (lip != number.end())
      beside_.push_back(
          {static_cast<std::uint32_t>(skin.vertices().size() + w), lip->second, 1 - walls[w].down});
  }
}

void LipGape::find_lips(const CutSkin& skin, double widest_mm) {
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> inner;  // by the edge across from it
  for (const SkinPart& part : skin.parts())
    for (int k = 0; k < 3; ++k)
      inner[{part.corners[(k + 1) % 3], part.corners[(k + 2) % 3]}] = part.corners[k];
  Neighbours along;
  std::map<std::uint32_t, std::uint32_t> others;
  std::vector<std::uint32_t> ends;
  for (const SkinBorder& border : skin.borders()) {
    for (const auto& [from, to] :
         {std::pair(border.left[0], border.left[1]), std::pair(border.right[1], border.right[0])}) {
      join(from, to, along);
      if (const auto corner = inner.find({from, to}); corner != inner.end())
        borders_.push_back({from, to, corner->second});
    }
    for (int end = 0; end < 2; ++end) {
      if (border.left[end] == border.right[end]) ends.push_back(border.left[end]);
      others.emplace(border.left[end], border.right[end]);
      others.emplace(border.right[end], border.left[end]);
    }
  }
  const auto from_end =
      ways_from(ends, along, skin.vertices(), [](std::uint32_t) { return kFree_mm; });
  for (const auto& [vertex, other] : others) {
    const auto way = from_end.find(vertex);
    const double share =
        way == from_end.end() ? 1 : std::sqrt(std::min(1.0, way->second.mm / kFree_mm));
    if (vertex != other && share > 0) lips_.push_back({vertex, other, share * widest_mm});
  }
}

// The less the farther from the lip.
void LipGape::find_beside(const CutSkin& skin, double widest_mm) {
  std::vector<std::uint32_t> sources;
  std::map<std::uint32_t, std::size_t> number;
  for (std::size_t l = 0; l < lips_.size(); ++l)
    number[lips_[l].vertex] = l, sources.push_back(lips_[l].vertex);
  const auto reach_mm = [&](std::uint32_t) { return 0.5 * kGiveWay * widest_mm; };
  for (const auto& [vertex, way] :
       ways_from(sources, neighbours_on(skin.parts()), skin.vertices(), reach_mm)) {
    const std::size_t lip = number[way.source];
    const double share = 1 - way.mm / (0.5 * kGiveWay * lips_[lip].gape_mm);
    if (!skin.vertices()[vertex].on_border && share > 0) beside_.push_back({vertex, lip, share});
  }
}

void LipGape::open(std::vector<Vector3d>& positions_mm) const {
  std::map<std::uint32_t, Vector3d> back;  // into the skin beside each lip
  for (const Border& border : borders_) {
    const Vector3d along = (positions_mm[border.to] - positions_mm[border.from]).stableNormalized();
    const Vector3d inward = positions_mm[border.inner] - positions_mm[border.from];
    const Vector3d across = (inward - along * along.dot(inward)).stableNormalized();
    for (const std::uint32_t lip : {border.from, border.to})
      back.try_emplace(lip, Vector3d::Zero()).first->second += across;
  }
  std::vector<Vector3d> moves(lips_.size(), Vector3d::Zero());
  for (std::size_t l = 0; l < lips_.size(); ++l) {
    const Lip& lip = lips_[l];
    const auto found = back.find(lip.vertex);
    if (found == back.end()) continue;
    const Vector3d way = found->second.stableNormalized();
    const double apart = way.dot(positions_mm[lip.vertex] - positions_mm[lip.other]);
    moves[l] = 0.5 * (lip.gape_mm - std::clamp(apart, 0.0, lip.gape_mm)) * way;
  }
  for (std::size_t l = 0; l < lips_.size(); ++l) positions_mm[lips_[l].vertex] += moves[l];
  for (const Beside& beside : beside_)
    positions_mm[beside.vertex] += beside.share * moves[beside.lip];
}

// What a wide blade takes away is not carved out of the tetrahedra: the lips are drawn back by half
// the width each instead, and the skin beside them gives way, so no new elements are needed.
namespace {

using Eigen::Vector3d;

// Widths of a cut from its lips within which the skin gives way: it is compressed to three quarters
// of what it was.
constexpr double kReach = 2;
constexpr double kLeastLeft = 0.25;  // of a piece of border's length
constexpr double kLeastAlong = 0.8;  // cosine of a lip's way by its sheet and by its border

using Vertices = std::vector<CutSkin::Vertex>;

// By half a cut's width, along the skin and square to the sheet: pieces of border may be too short
// to tell. Where its lips hang together, not.
void draw_lips_back(const CutSkin& skin, const CutSheet& sheet, Vertices& vertices) {
  struct Pull {
    Vector3d back = Vector3d::Zero(), normal = Vector3d::Zero();
    double half_mm = 0;
  };
  std::map<std::uint32_t, Pull> pulls;  // by vertex
  for (const SkinBorder& border : skin.borders()) {
    const double half = 0.5 * sheet.width_mm(vertices[border.left[0]].place.stroke);
    const Vector3d along = vertices[border.left[1]].at_mm - vertices[border.left[0]].at_mm;
    const Vector3d normal = skin.normal_beside(border), to_left = normal.cross(along);
    for (int end = 0; half > 0 && end < 2; ++end) {
      if (border.left[end] == border.right[end]) continue;
      for (const auto& [lip, side] :
           {std::pair(border.left[end], 1.0), std::pair(border.right[end], -1.0)}) {
        Pull& pull = pulls[lip];
        pull.back += side * to_left, pull.normal += normal;
        pull.half_mm = std::max(pull.half_mm, half);
      }
    }
  }
  for (const auto& [lip, pull] : pulls) {
    const Vector3d across = sheet.across(vertices[lip].place);
    const Vector3d normal = pull.normal.stableNormalized();
    Vector3d back = across - normal * normal.dot(across);
    const double along = back.stableNormalized().dot(pull.back.stableNormalized());
    if (std::abs(along) < kLeastAlong) back = pull.back;  // where cuts meet, or a blade stood still
    const double far_mm = back.dot(pull.back) < 0 ? -pull.half_mm : pull.half_mm;
    vertices[lip].drawn_back_mm = far_mm * back.stableNormalized();
  }
}

// On the inner side of a corner lips would be drawn past each other, and the walls below them would
// lie in folds: there they are drawn back less.
void keep_lips_in_order(const CutSkin& skin, Vertices& vertices) {
  std::set<std::uint32_t> tight;
  do {
    tight.clear();
    for (const SkinBorder& border : skin.borders())
      for (const auto& [a, b] : {border.left, border.right}) {
        const Vector3d along = vertices[b].at_mm - vertices[a].at_mm;
        const Vector3d drawn = vertices[b].drawn_back_mm - vertices[a].drawn_back_mm;
        if (along.dot(along + drawn) < kLeastLeft * along.squaredNorm()) tight.insert({a, b});
      }
    for (const std::uint32_t lip : tight) vertices[lip].drawn_back_mm *= 0.5;
  } while (!tight.empty());
}

// Skin beside a lip goes with it the less the farther off it is, along its edges: what lies across
// a cut is not near.
void draw_beside_back(const std::vector<SkinPart>& parts, Vertices& vertices) {
  std::vector<std::uint32_t> lips;
  for (std::uint32_t v = 0; v < vertices.size(); ++v)
    if (vertices[v].on_border) lips.push_back(v);
  const auto reach_mm = [&](std::uint32_t lip) {
    return 2 * kReach * vertices[lip].drawn_back_mm.norm();
  };
  for (const auto& [v, way] : ways_from(lips, neighbours_on(parts), vertices, reach_mm)) {
    const double reach = reach_mm(way.source);
    if (v != way.source && way.mm < reach)
      vertices[v].drawn_back_mm = (1 - way.mm / reach) * vertices[way.source].drawn_back_mm;
  }
}

}  // namespace

void draw_skin_back(const CutSkin& skin, const CutSheet& sheet, Vertices& vertices) {
  draw_lips_back(skin, sheet, vertices);
  keep_lips_in_order(skin, vertices);
  if (std::all_of(vertices.begin(), vertices.end(),
                  [](const CutSkin::Vertex& v) { return v.drawn_back_mm.isZero(0); }))
    return;
  draw_beside_back(skin.parts(), vertices);
  for (CutSkin::Vertex& vertex : vertices)
    vertex.at_mm += vertex.drawn_back_mm, vertex.side_mm += vertex.drawn_back_mm;
}

}  // namespace organbake
