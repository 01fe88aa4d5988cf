// SPDX-License-Identifier: Apache-2.0
// Tetrahedra and skin made finer beside a sheet: which lie near it, their longest edges halved
// (bisection keeps the mesh closed), and the skin's faces alike.
#include "refinement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "organbake/cutting/cut_skin.h"

namespace organbake {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr double kRoundSheet_mm = 2;  // a sheet's end opens from a little before it

}  // namespace

SheetNeighbourhood::SheetNeighbourhood(const MaterialGrid& grid,
                                       std::span<const CutSheet::Triangle> triangles) {
  for (const CutSheet::Triangle& triangle : triangles) {
    if (triangle.farther_out) continue;
    Near near;
    for (int k = 0; k < 3; ++k) near.corners[k] = grid.place_mm(triangle.corners[k]);
    for (const Eigen::Vector3d& corner : near.corners) near.box.add(corner);
    near.fine_mm = triangle.fine_mm;
    const double round_mm = std::min(kRoundSheet_mm, near.fine_mm);
    near.box.min.array() -= round_mm, near.box.max.array() += round_mm;
    near.normal = (near.corners[1] - near.corners[0])
                      .cross(near.corners[2] - near.corners[0])
                      .stableNormalized();
    all_.add(near.box.min), all_.add(near.box.max);
    near_.push_back(near);
  }
}

bool SheetNeighbourhood::meets(std::span<const Eigen::Vector3d> corners_mm) const {
  return fine_mm(corners_mm) < kNowhere;
}

double SheetNeighbourhood::fine_mm(std::span<const Eigen::Vector3d> corners_mm) const {
  Bounds box;
  for (const Eigen::Vector3d& corner : corners_mm) box.add(corner);
  double finest = kNowhere;
  if (!box.meets(all_)) return finest;
  for (const Near& near : near_) {
    if (near.fine_mm >= finest || !box.meets(near.box)) continue;
    double low = kNowhere, high = -kNowhere;
    for (const Eigen::Vector3d& corner : corners_mm) {
      const double away = near.normal.dot(corner - near.corners[0]);
      low = std::min(low, away), high = std::max(high, away);
    }
    if (low <= 0 && high >= 0) finest = near.fine_mm;
  }
  return finest;
}

namespace {

// Squared lengths that differ by less are equal: along a lattice's rows all longest edges are, and
// to halve the last of them first would halve them all.
constexpr double kLonger = 1.000001;

// By length, then by its nodes: no two edges are equal, and who asks finds the same one longest.
struct LongEdge {
  double length2_mm2;
  std::uint32_t low, high;

  bool operator<(const LongEdge& other) const {
    return std::tie(length2_mm2, low, high) < std::tie(other.length2_mm2, other.low, other.high);
  }
};

Face& corners(Face& face) { return face; }
const Face& corners(const Face& face) { return face; }
auto& corners(Tetrahedron& tetrahedron) { return tetrahedron.nodes; }
const auto& corners(const Tetrahedron& tetrahedron) { return tetrahedron.nodes; }

template <class Cell>
LongEdge longest_edge(const std::vector<Eigen::Vector3d>& nodes_mm, const Cell& cell) {
  const auto& own = corners(cell);
  LongEdge longest{-1, 0, 0};
  for (std::size_t a = 0; a < own.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const auto [low, high] = std::minmax(own[a], own[b]);
      const LongEdge edge{(nodes_mm[high] - nodes_mm[low]).squaredNorm(), low, high};
      longest = std::max(longest, edge);
    }
  }
  return longest;
}

template <class Cell>
class Bisector {
 public:
  Bisector(std::vector<Eigen::Vector3d>& nodes_mm, std::vector<Cell>& cells)
      : nodes_mm_(nodes_mm), cells_(cells), round_(nodes_mm.size()) {
    for (std::uint32_t c = 0; c < cells.size(); ++c)
      for (const std::uint32_t n : corners(cells[c])) round_[n].push_back(c);
    result_.part_of.resize(cells.size());
    std::iota(result_.part_of.begin(), result_.part_of.end(), 0u);
  }

  Bisection run(const std::function<bool(std::uint32_t)>& is_coarse) {
    for (std::uint32_t c = 0; c < cells_.size(); ++c)
      while (is_coarse(c)) halve(c);
    return std::move(result_);
  }

 private:
  // Those round an edge, increasing.
  std::vector<std::uint32_t> round(const LongEdge& edge) const {
    std::vector<std::uint32_t> both;
    for (const std::uint32_t c : round_[edge.low]) {
      const auto& own = corners(cells_[c]);
      if (std::find(own.begin(), own.end(), edge.high) != own.end()) both.push_back(c);
    }
    std::sort(both.begin(), both.end());
    return both;
  }

  void halve(std::uint32_t cell) {
    const LongEdge own = longest_edge(nodes_mm_, cells_[cell]);
    const std::vector<std::uint32_t> both = round(own);
    for (const std::uint32_t c : both) {
      // Its longest edge is longer than this one: that goes on until there is none.
      if (longest_edge(nodes_mm_, cells_[c]).length2_mm2 > kLonger * own.length2_mm2)
        return halve(c);
    }
    split(own, both);
  }

  void split(const LongEdge& edge, const std::vector<std::uint32_t>& both) {
    const auto middle = static_cast<std::uint32_t>(nodes_mm_.size());
    nodes_mm_.emplace_back(0.5 * (nodes_mm_[edge.low] + nodes_mm_[edge.high]));
    result_.halved.push_back({edge.low, edge.high});
    round_.emplace_back();
    for (const std::uint32_t c : both) {
      const auto other = static_cast<std::uint32_t>(cells_.size());
      Cell half = cells_[c];
      auto &kept = corners(cells_[c]), &split_off = corners(half);
      std::replace(split_off.begin(), split_off.end(), edge.low, middle);
      std::replace(kept.begin(), kept.end(), edge.high, middle);
      std::erase(round_[edge.high], c);
      round_[middle].push_back(c);
      for (const std::uint32_t n : split_off) round_[n].push_back(other);
      cells_.push_back(half);
      result_.part_of.push_back(result_.part_of[c]);
    }
  }

  std::vector<Eigen::Vector3d>& nodes_mm_;
  std::vector<Cell>& cells_;
  std::vector<std::vector<std::uint32_t>> round_;  // cells, by node
  Bisection result_;
};

}  // namespace

double longest_edge_mm(const TriangleMesh& mesh, const Face& face) {
  return std::sqrt(longest_edge(mesh.vertices, face).length2_mm2);
}

double longest_edge_mm(const TetrahedralBody& body, const Tetrahedron& tetrahedron) {
  return std::sqrt(longest_edge(body.nodes_mm, tetrahedron).length2_mm2);
}

Bisection bisect(TriangleMesh& mesh, const std::function<bool(std::uint32_t)>& is_coarse) {
  return Bisector(mesh.vertices, mesh.faces).run(is_coarse);
}

Bisection bisect(TetrahedralBody& body, const std::function<bool(std::uint32_t)>& is_coarse) {
  std::vector<std::uint8_t> anchored(body.nodes_mm.size(), 0);
  for (const std::uint32_t n : body.anchors) anchored[n] = 1;
  const std::size_t first_new = body.nodes_mm.size();
  Bisection result = Bisector(body.nodes_mm, body.tetrahedra).run(is_coarse);
  for (std::size_t i = 0; i < result.halved.size(); ++i) {
    const auto [a, b] = result.halved[i];
    anchored.push_back(anchored[a] & anchored[b]);
    if (anchored.back()) body.anchors.push_back(static_cast<std::uint32_t>(first_new + i));
  }
  if (!result.none()) body.vertices.clear(), body.patches.clear();
  return result;
}

namespace {

constexpr std::size_t kMostFaces = 40'000;
constexpr std::uint32_t kRankOfSkinMiddles = 0xC000'0000;

std::vector<CutSheet::Triangle> in_tissue(std::span<const CutSheet::Triangle> triangles) {
  std::vector<CutSheet::Triangle> in;
  std::copy_if(triangles.begin(), triangles.end(), std::back_inserter(in),
               [](const CutSheet::Triangle& t) { return !t.farther_out; });
  return in;
}

// Where a vertex lies in a face that has since been halved: at one of its corners, or half-way
// between the ends of an edge that was.
Eigen::Vector2d place_in(const Face& face, std::uint32_t vertex, const Bisection& halved,
                         std::size_t first_halved) {
  const auto corner = std::find(face.begin(), face.end(), vertex);
  if (corner != face.end()) return kCornersInFace[static_cast<std::size_t>(corner - face.begin())];
  const auto [a, b] = halved.halved[vertex - first_halved];
  return 0.5 * (place_in(face, a, halved, first_halved) + place_in(face, b, halved, first_halved));
}

}  // namespace

FineSkin::FineSkin(TriangleMesh skin, const MaterialGrid& grid, std::uint32_t first_rank)
    : mesh_(std::move(skin)),
      grid_(grid),
      edges_(grid.snapped(mesh_.vertices, first_rank), edges_of(mesh_.faces)) {
  for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) parts_.push_back({f, kCornersInFace});
}

bool FineSkin::add(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  const bool finer = refine(triangles, first_new);
  return edges_.add(in_tissue(triangles.subspan(first_new))) || finer;
}

bool FineSkin::refine(std::span<const CutSheet::Triangle> triangles, std::size_t first_new) {
  const SheetNeighbourhood near(grid_, triangles.subspan(first_new));
  if (near.empty()) return false;
  const std::vector<Face> before = mesh_.faces;
  const std::size_t first_halved = mesh_.vertices.size();
  const Bisection halved = bisect(mesh_, [&](std::uint32_t f) {
    const auto& [a, b, c] = mesh_.faces[f];
    const std::array corners = {mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]};
    return mesh_.faces.size() < kMostFaces &&
           longest_edge_mm(mesh_, mesh_.faces[f]) > near.fine_mm(corners);
  });
  if (halved.none()) return false;
  std::vector<Part> parts;
  for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
    const Part& whole = parts_[halved.part_of[f]];
    Part& part = parts.emplace_back(whole);
    for (int k = 0; k < 3; ++k) {
      part.at[k] = within(
          whole.at, place_in(before[halved.part_of[f]], mesh_.faces[f][k], halved, first_halved));
    }
  }
  parts_ = std::move(parts);
  edges_ = edges_.finer(mesh_.vertices, grid_, kRankOfSkinMiddles, edges_of(mesh_.faces),
                        in_tissue(triangles.first(first_new)));
  return true;
}

}  // namespace organbake
