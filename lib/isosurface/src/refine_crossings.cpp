// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices of a contour moved along their grid edges to where sums of voxels say that the edge of
// the tissue lies (height functions; Cummins, Francois, Kothe 2005): a scanner measures means over
// voxels, not values at points, and a straight line between two means is off.
#include "refine_crossings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// A transition longer than this many voxels on one side is a grazing edge, where the values change
// slowly and a straight line is right.
constexpr int kLongestSide = 4;
// Of the way from the lower plateau to the upper: a level nearer to either is no edge between them.
constexpr double kLeastRefinedShare = 0.25;
constexpr double kEdgeMargin = 1.0 / 256;  // as contour() keeps it

// The edge of the grid that a vertex lies on: from voxel `from` on along `axis`.
struct GridEdge {
  Eigen::Vector3i from;
  int axis = -1;
};

std::optional<GridEdge> edge_of(const Eigen::Vector3d& vertex, const std::array<int, 3>& size) {
  GridEdge edge;
  for (int a = 0; a < 3; ++a) {
    edge.from[a] = static_cast<int>(std::floor(vertex[a]));
    const bool between = vertex[a] != edge.from[a];
    if (between) edge.axis = a;
    if (edge.from[a] < 0 || edge.from[a] + (between ? 1 : 0) >= size[a]) return std::nullopt;
  }
  return edge.axis < 0 ? std::nullopt : std::optional(edge);
}

// The values of one row of the grid, seen so that they rise at the edge.
template <typename Value>
class Row {
 public:
  Row(std::span<const Value> values, const std::array<int, 3>& size, const GridEdge& edge)
      : length_(size[edge.axis]), first_(edge.from[edge.axis]) {
    Eigen::Vector3i at = edge.from;
    at[edge.axis] = 0;
    stride_ = 1;
    for (int a = 0; a < edge.axis; ++a) stride_ *= size[a];
    values_ = values.data() + (std::ptrdiff_t(at.z()) * size[1] + at.y()) * size[0] + at.x();
    sign_ = value(first_ + 1) > value(first_) ? 1 : -1;
  }

  // Where the edge between voxels first and first + 1 crosses `level`, as an index along the row.
  double straight_crossing(double level) const {
    const double from = value(first_);
    return first_ + (level - from) / (value(first_ + 1) - from);
  }
  std::optional<double> summed_crossing(double level) const {
    const std::optional<int> low = end_of_slope(first_, -1), high = end_of_slope(first_ + 1, 1);
    if (!low || !high) return std::nullopt;
    const double from = value(*low), span = value(*high) - from;
    const double share = (level - from) / span;
    if (!(share >= kLeastRefinedShare && share <= 1 - kLeastRefinedShare)) return std::nullopt;
    double below = 0;  // voxels' worth of the first plateau
    for (int i = *low; i <= *high; ++i) below += 1 - (value(i) - from) / span;
    return *low - 0.5 + below + (share - 0.5);
  }

 private:
  double value(int i) const { return values_[i * stride_]; }

  // The last voxel to which the values go on rising (or falling) from `i` in direction `step`.
  std::optional<int> end_of_slope(int i, int step) const {
    for (int side = 0; side < kLongestSide; ++side) {
      const int next = i + step;
      if (next < 0 || next >= length_) return i;
      if (!(sign_ * step * (value(next) - value(i)) > 0)) return i;
      i = next;
    }
    return std::nullopt;
  }

  int length_, first_;
  int sign_ = 1;
  std::ptrdiff_t stride_;
  const Value* values_;
};

// Moves every vertex along its edge to where `crossing` of the edge's row says.
template <typename Crossing>
void move_along_edges(TriangleMesh& mesh, const Volume& ct, const Crossing& crossing) {
  with_values(ct, [&](const auto values) {
    constexpr std::size_t kVerticesAtOnce = 4096;
    parallel_pieces(std::size_t{0}, mesh.vertices.size(), kVerticesAtOnce,
                    [&](std::size_t first, std::size_t last) {
                      for (std::size_t v = first; v < last; ++v) {
                        Eigen::Vector3d& vertex = mesh.vertices[v];
                        const std::optional<GridEdge> edge = edge_of(vertex, ct.size);
                        if (!edge) continue;
                        const double at = crossing(Row(values, ct.size, *edge));
                        const int from = edge->from[edge->axis];
                        if (!std::isfinite(at)) continue;
                        vertex[edge->axis] =
                            std::clamp(at, from + kEdgeMargin, from + 1 - kEdgeMargin);
                      }
                    });
  });
}

}  // namespace

void place_crossings(TriangleMesh& mesh, const Volume& ct, double level) {
  move_along_edges(mesh, ct, [&](const auto& row) { return row.straight_crossing(level); });
}

void refine_crossings(TriangleMesh& mesh, const Volume& ct, double level) {
  move_along_edges(mesh, ct, [&](const auto& row) {
    return row.summed_crossing(level).value_or(row.straight_crossing(level));
  });
}

}  // namespace organbake
