// SPDX-License-Identifier: Apache-2.0
// A body of tetrahedra cut by a sheet, step after step, and the way from the world back to the
// tissue: barycentric weights in the deformed tetrahedron are those at rest, as linear elements
// have it.
#include "organbake/cutting/cut_body.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "refinement.h"

namespace organbake {
PosedBody::PosedBody(const CutBody& body, const std::vector<Eigen::Vector3d>& nodes_mm)
    : body_(body), nodes_mm_(nodes_mm) {
  for (const CutTetrahedra::Copy& copy : body.cut().copies()) {
    Eigen::Vector3d low = nodes_mm[copy.nodes[0]], high = low;
    for (const std::uint32_t n : copy.nodes)
      low = low.cwiseMin(nodes_mm[n]), high = high.cwiseMax(nodes_mm[n]);
    low_.push_back(low), high_.push_back(high);
  }
}

std::array<double, 4> PosedBody::weights(std::uint32_t copy,
                                         const Eigen::Vector3d& world_mm) const {
  const auto& nodes = body_.cut().copies()[copy].nodes;
  Eigen::Matrix3d edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = nodes_mm_[nodes[k + 1]] - nodes_mm_[nodes[0]];
  const Eigen::Vector3d share = edges.inverse() * (world_mm - nodes_mm_[nodes[0]]);
  return {1 - share.sum(), share[0], share[1], share[2]};
}

Eigen::Vector3d PosedBody::mixed(std::uint32_t copy, const std::array<double, 4>& weights) const {
  const CutTetrahedra& cut = body_.cut();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k)
    sum += weights[k] * body_.uncut().nodes_mm[cut.original(cut.copies()[copy].nodes[k])];
  return sum;
}

std::vector<std::uint32_t> PosedBody::near(const Eigen::Vector3d& low_mm,
                                           const Eigen::Vector3d& high_mm) const {
  std::vector<std::uint32_t> copies;
  for (std::uint32_t copy = 0; copy < low_.size(); ++copy) {
    if ((low_mm.array() <= high_[copy].array()).all() &&
        (high_mm.array() >= low_[copy].array()).all())
      copies.push_back(copy);
  }
  return copies;
}

std::optional<PosedBody::Found> PosedBody::find(const Eigen::Vector3d& world_mm,
                                                const std::vector<std::uint32_t>& copies) const {
  for (const std::uint32_t copy : copies) {
    if ((world_mm.array() < low_[copy].array()).any() ||
        (world_mm.array() > high_[copy].array()).any())
      continue;
    const std::array<double, 4> w = weights(copy, world_mm);
    if (!(*std::min_element(w.begin(), w.end()) >= -CutBody::kRoundedWeight))
      continue;  // or a flattened element, not a number
    const Eigen::Vector3d at = mixed(copy, w);
    if (body_.holds(copy, at)) return Found{copy, at};
  }
  return std::nullopt;
}

Eigen::Vector3d PosedBody::at_rest(std::uint32_t copy, const Eigen::Vector3d& world_mm) const {
  return mixed(copy, weights(copy, world_mm));
}

namespace {

// Edges that are cut open in steps of their length; shorter ones cost more than they show.
constexpr double kFineBody_mm = 3;
constexpr std::size_t kMostTetrahedra = 40'000;  // a step takes too long beyond
constexpr std::uint32_t kRankOfBodyMiddles = 0x8000'0000;

// Of a tetrahedron's box: beyond it, too, skin may lie that it carries.
constexpr double kWider = 0.25;
// A place farther out is carried as the nearest of a tetrahedron's is.
constexpr double kFarthestWeight = 0.5;

Bounds bounds_of(const TetrahedralBody& body) {
  Bounds box;
  for (const Eigen::Vector3d& node : body.nodes_mm) box.add(node);
  return box;
}

double least(const std::array<double, 4>& weights) {
  return *std::min_element(weights.begin(), weights.end());
}

std::array<double, 4> limited(std::array<double, 4> weights) {
  if (least(weights) >= -kFarthestWeight) return weights;
  double sum = 0;
  for (double& w : weights) sum += w = std::max(w, 0.0);
  for (double& w : weights) w /= sum;
  return weights;
}

}  // namespace

CutBody::CutBody(const TetrahedralBody& body)
    : body_(body),
      first_nodes_(static_cast<std::uint32_t>(body.nodes_mm.size())),
      grid_(bounds_of(body).center()),
      edges_(grid_.snapped(body.nodes_mm, 0), edges_of(body.tetrahedra)),
      cut_(body_, edges_),
      near_barriers_(body.tetrahedra.size()) {
  for (std::uint32_t e = 0; e < edges_.count(); ++e)
    mean_edge_mm_ +=
        (body_.nodes_mm[edges_.edge(e)[1]] - body_.nodes_mm[edges_.edge(e)[0]]).norm() /
        static_cast<double>(edges_.count());
  measure();
}

// What is asked of each tetrahedron again and again.
void CutBody::measure() {
  gradients_.clear(), boxes_.clear();
  for (const Tetrahedron& t : body_.tetrahedra) {
    gradients_.push_back(gradients_of(body_, t));
    GridBox box(edges_.point(t.nodes[0]));
    for (const std::uint32_t n : t.nodes) box.add(edges_.point(n));
    for (int c = 0; c < 3; ++c) {
      const auto more = static_cast<std::int64_t>(kWider * double(box.high[c] - box.low[c]));
      box.low[c] -= more, box.high[c] += more;
    }
    boxes_.push_back(box);
  }
  cells_.sort_in(body_, mean_edge_mm_);
  fine_cells_.sort_in(body_, 2 * kFineBody_mm);
}

void CutBody::Cells::sort_in(const TetrahedralBody& body, double least_mm) {
  const Bounds box = bounds_of(body);
  low_mm = box.min;
  constexpr double kMostCells = 64;  // a side
  size_mm = std::max(least_mm, (box.max - box.min).maxCoeff() / kMostCells);
  count = ((box.max - box.min) / size_mm).array().floor().cast<int>() + 1;
  tetrahedra.assign(static_cast<std::size_t>(count.prod()), {});
  for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t) {
    Bounds own;
    for (const std::uint32_t n : body.tetrahedra[t].nodes) own.add(body.nodes_mm[n]);
    const Eigen::Array3i first = ((own.min - low_mm) / size_mm).array().floor().cast<int>().max(0);
    const Eigen::Array3i last =
        ((own.max - low_mm) / size_mm).array().floor().cast<int>().min(count - 1);
    for (int z = first.z(); z <= last.z(); ++z)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int x = first.x(); x <= last.x(); ++x)
          tetrahedra[(std::size_t(z) * count.y() + y) * count.x() + x].push_back(t);
  }
}

template <class Use>
void CutBody::Cells::each_near(const Eigen::Vector3d& at_mm, int reach, const Use& use) const {
  const Eigen::Array3i cell =
      ((at_mm - low_mm) / size_mm).array().floor().max(-1).min(1e6).cast<int>();
  const Eigen::Array3i first = (cell - reach).max(0), last = (cell + reach).min(count - 1);
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x)
        for (const std::uint32_t t : tetrahedra[(std::size_t(z) * count.y() + y) * count.x() + x])
          use(t);
}

bool CutBody::add(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  const bool finer = refine(triangles, first_new);
  const std::span added = triangles.subspan(first_new);
  add_barriers(added);
  if (!edges_.add(added) && !finer) return false;
  CutTetrahedra now(body_, edges_);
  const bool changed = finer || !now.same_as(cut_);
  if (changed) cut_ = std::move(now);
  return changed;
}

void CutBody::add_barriers(std::span<const CutSheet::Triangle> triangles) {
  if (triangles.empty()) return;
  const std::size_t first = barriers_.size();
  GridBox all = box_of(triangles.front());
  for (const CutSheet::Triangle& triangle : triangles) {
    barriers_.push_back({triangle.corners, box_of(triangle)});
    all.add(barriers_.back().box);
  }
  for (std::size_t t = 0; t < boxes_.size(); ++t) {
    if (!boxes_[t].meets(all)) continue;
    for (std::size_t b = first; b < barriers_.size(); ++b)
      if (boxes_[t].meets(barriers_[b].box))
        near_barriers_[t].push_back(static_cast<std::uint32_t>(b));
  }
}

std::array<double, 4> CutBody::weights_in(std::uint32_t tetrahedron,
                                          const Eigen::Vector3d& at_mm) const {
  const Tetrahedron& t = body_.tetrahedra[tetrahedron];
  const Eigen::Vector3d from_first = at_mm - body_.nodes_mm[t.nodes[0]];
  std::array<double, 4> weights;
  for (int k = 1; k < 4; ++k) weights[k] = gradients_[tetrahedron].row(k).dot(from_first);
  weights[0] = 1 - weights[1] - weights[2] - weights[3];
  return weights;
}

std::uint32_t CutBody::tetrahedron_at(const Eigen::Vector3d& at_mm) const {
  std::uint32_t best = 0;
  double best_least = -std::numeric_limits<double>::infinity();
  const auto look_at = [&](std::uint32_t t) {
    const double here = least(weights_in(t, at_mm));
    if (here > best_least) best_least = here, best = t;
  };
  // All that hold the place share its cell, in either grid; only outside the body others count.
  fine_cells_.each_near(at_mm, 0, look_at);
  if (best_least >= 0) return best;
  best = 0, best_least = -std::numeric_limits<double>::infinity();
  cells_.each_near(at_mm, 0, look_at);
  if (best_least < -kRoundedWeight) cells_.each_near(at_mm, 1, look_at);
  if (best_least < -1) {
    for (std::uint32_t t = 0; t < body_.tetrahedra.size(); ++t) look_at(t);
  }
  return best;
}

// The copy of the nearest corner to which a straight way leads that no sheet bars; else, of the one
// to which the fewest do.
CutBody::SeenCopy CutBody::copy_of(std::uint32_t tetrahedron, const Eigen::Vector3d& at_mm) const {
  const auto& nodes = body_.tetrahedra[tetrahedron].nodes;
  const GridPoint from = grid_.snapped(at_mm, first_nodes_);
  std::array<int, 4> corners = {0, 1, 2, 3};
  std::array<double, 4> away;
  for (int k = 0; k < 4; ++k) away[k] = (body_.nodes_mm[nodes[k]] - at_mm).squaredNorm();
  std::sort(corners.begin(), corners.end(),
            [&](int a, int b) { return away[a] != away[b] ? away[a] < away[b] : a < b; });
  int best = corners[0];
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const int corner : corners) {
    const GridPoint& to = edges_.point(nodes[corner]);
    GridBox way(from);
    way.add(to);
    std::size_t bars = 0;
    for (const std::uint32_t b : near_barriers_[tetrahedron]) {
      bars += barriers_[b].box.meets(way) && crosses(from, to, barriers_[b].corners);
      if (bars >= fewest) break;
    }
    if (bars < fewest) fewest = bars, best = corner;
    if (bars == 0) break;
  }
  return {cut_.copy_at({tetrahedron, best}), fewest == 0};
}

TissuePlace CutBody::place(const Eigen::Vector3d& at_mm, const Eigen::Vector3d& side_mm,
                           const TissuePlace* beside) const {
  const std::uint32_t t = tetrahedron_at(side_mm);
  // Of a place outside, a whole tetrahedron may lie beyond the cut, too.
  const bool outside = least(weights_in(t, side_mm)) < -kRoundedWeight;
  if (!cut_.split(t) && !(beside && outside))
    return {cut_.first_copy(t), limited(weights_in(t, at_mm))};
  const SeenCopy seen = copy_of(t, side_mm);
  if (seen.in_sight || !beside) return {seen.copy, limited(weights_in(t, at_mm))};
  const std::uint32_t other = cut_.copies()[beside->copy].tetrahedron;
  return {beside->copy, limited(weights_in(other, at_mm))};
}

bool CutBody::holds(std::uint32_t copy, const Eigen::Vector3d& at_mm) const {
  const std::uint32_t t = cut_.copies()[copy].tetrahedron;
  return !cut_.split(t) || copy_of(t, at_mm).copy == copy;
}

// Those tetrahedra are halved that a sheet passes through, or next to.
bool CutBody::refine(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  part_of_.resize(body_.tetrahedra.size());
  std::iota(part_of_.begin(), part_of_.end(), 0u);
  const SheetNeighbourhood near(grid_, triangles.subspan(first_new));
  if (near.empty()) return false;
  Bisection halved = bisect(body_, [&](std::uint32_t t) {
    const Tetrahedron& tetrahedron = body_.tetrahedra[t];
    std::array<Eigen::Vector3d, 4> corners;
    for (int k = 0; k < 4; ++k) corners[k] = body_.nodes_mm[tetrahedron.nodes[k]];
    return body_.tetrahedra.size() < kMostTetrahedra && near.meets(corners) &&
           longest_edge_mm(body_, tetrahedron) > kFineBody_mm;
  });
  if (halved.none()) return false;
  part_of_ = std::move(halved.part_of);
  edges_ = edges_.finer(body_.nodes_mm, grid_, kRankOfBodyMiddles, edges_of(body_.tetrahedra),
                        triangles.first(first_new));
  measure();
  std::vector<std::vector<std::uint32_t>> near_barriers(body_.tetrahedra.size());
  for (std::uint32_t t = 0; t < near_barriers.size(); ++t) {
    for (const std::uint32_t b : near_barriers_[part_of_[t]])
      if (boxes_[t].meets(barriers_[b].box)) near_barriers[t].push_back(b);
  }
  near_barriers_ = std::move(near_barriers);
  return true;
}

std::vector<NodeSource> CutBody::sources(const CutBody& before) const {
  std::vector<NodeSource> sources(cut_.node_count());
  std::vector<std::uint8_t> known(sources.size(), 0);
  for (std::uint32_t n = 0; n < first_nodes_; ++n) sources[n] = {{n, n, n, n}, {1, 0, 0, 0}};
  for (std::uint32_t c = 0; c < cut_.copies().size(); ++c) {
    const CutTetrahedra::Copy& copy = cut_.copies()[c];
    const std::uint32_t part_of = part_of_[copy.tetrahedron];
    const int held = cut_.held_corner(c).corner;
    const std::uint32_t node = body_.tetrahedra[copy.tetrahedron].nodes[held];
    const auto& nodes = before.body_.tetrahedra[part_of].nodes;
    const auto corner = std::find(nodes.begin(), nodes.end(), node);
    const std::uint32_t was =
        corner != nodes.end()
            ? before.cut_.copy_at({part_of, static_cast<int>(corner - nodes.begin())})
            : before.copy_of(part_of, body_.nodes_mm[node]).copy;
    for (int k = 0; k < 4; ++k) {
      if (std::exchange(known[copy.nodes[k]], 1)) continue;
      sources[copy.nodes[k]] = before.place_of(part_of, body_.tetrahedra[copy.tetrahedron].nodes[k],
                                               body_.nodes_mm, was);
    }
  }
  return sources;
}

// A node of the body, or the middle of an edge of it, by the nodes of a tetrahedron's copy.
NodeSource CutBody::place_of(std::uint32_t tetrahedron, std::uint32_t node,
                             const std::vector<Eigen::Vector3d>& nodes_mm,
                             std::uint32_t copy) const {
  const auto& own = body_.tetrahedra[tetrahedron].nodes;
  NodeSource source{cut_.copies()[copy].nodes, {}};
  const auto corner = std::find(own.begin(), own.end(), node);
  if (corner == own.end()) {
    source.weights = weights_in(tetrahedron, nodes_mm[node]);
  } else {
    source.weights[static_cast<std::size_t>(corner - own.begin())] = 1;
  }
  return source;
}

}  // namespace organbake
