// SPDX-License-Identifier: Apache-2.0
// A crack in a stretched sheet opens as an ellipse (Inglis 1913): with the root of the distance
// from its tip, and the wider the longer it is. Skin on tissue holds on to that: over a few
// millimetres it is free to slip (kFree_mm), and a longer cut is no wider in its middle. So is the
// gape of a lip the widest times the root of its distance from the nearest end of the cut, along
// it, over kFree_mm, one at most. With a capsule or serosa stretched by some 5 to 10 % that is
// free over ten millimetres or so across a cut, the widest comes to about a millimetre; fresh cuts
// of liver and bowel that nobody pulls on gape by one half to two: the widest is the tissue's own
// (MechanicsModel::cut_gape_mm).
#include "organbake/cutting/lip_gape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
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

// From each vertex the way (mm) to the nearest source, and that (Dijkstra 1959), as far as `most`.
struct Reached {
  double mm = kFar;
  std::uint32_t source = 0;
};
std::map<std::uint32_t, Reached> ways_from(const std::vector<std::uint32_t>& sources,
                                           const Neighbours& neighbours, const CutSkin& skin,
                                           double most_mm) {
  std::map<std::uint32_t, Reached> reached;
  using Next = std::tuple<double, std::uint32_t, std::uint32_t>;
  std::priority_queue<Next, std::vector<Next>, std::greater<>> next;
  for (const std::uint32_t source : sources) next.emplace(0, source, source);
  while (!next.empty()) {
    const auto [mm, vertex, source] = next.top();
    next.pop();
    if (mm >= most_mm || !reached.try_emplace(vertex, Reached{mm, source}).second) continue;
    const auto beside = neighbours.find(vertex);
    if (beside == neighbours.end()) continue;
    for (const std::uint32_t n : beside->second)
      next.emplace(mm + (skin.vertices()[n].at_mm - skin.vertices()[vertex].at_mm).norm(), n,
                   source);
  }
  return reached;
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
  const auto from_end = ways_from(ends, along, skin, kFree_mm);
  for (const auto& [vertex, other] : others) {
    const auto way = from_end.find(vertex);
    const double share = way == from_end.end() ? 1 : std::sqrt(way->second.mm / kFree_mm);
    if (vertex != other && share > 0) lips_.push_back({vertex, other, share * widest_mm});
  }
}

// The less the farther from the lip.
void LipGape::find_beside(const CutSkin& skin, double widest_mm) {
  std::vector<std::uint32_t> sources;
  std::map<std::uint32_t, std::size_t> number;
  for (std::size_t l = 0; l < lips_.size(); ++l)
    number[lips_[l].vertex] = l, sources.push_back(lips_[l].vertex);
  Neighbours neighbours;
  for (const SkinPart& part : skin.parts())
    for (int k = 0; k < 3; ++k) join(part.corners[k], part.corners[(k + 1) % 3], neighbours);
  for (const auto& [vertex, way] :
       ways_from(sources, neighbours, skin, 0.5 * kGiveWay * widest_mm)) {
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

}  // namespace organbake
