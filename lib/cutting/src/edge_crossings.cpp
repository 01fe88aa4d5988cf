// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/edge_crossings.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace organbake {
namespace {

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
