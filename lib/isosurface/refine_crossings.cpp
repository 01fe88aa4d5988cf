// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/contour.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace organbake {
namespace {

// A transition longer than this many voxels on one side is a grazing edge, where the values change
// slowly and a straight line is right.
constexpr int kLongestSide = 4;
// Of the way from the lower plateau to the upper: a level nearer to either is no edge between them.
constexpr double kLeastRefinedShare = 0.25;
constexpr double kEdgeMargin = 1.0 / 256;  // as contour() keeps it

// The values of one row of the grid, seen so that they rise at the edge.
class Row {
 public:
  Row(const Volume& ct, Eigen::Vector3i at, int axis) : length_(ct.size[axis]), first_(at[axis]) {
    at[axis] = 0;
    stride_ = 1;
    for (int a = 0; a < axis; ++a) stride_ *= ct.size[a];
    values_ =
        ct.voxels.data() + (std::ptrdiff_t(at.z()) * ct.size[1] + at.y()) * ct.size[0] + at.x();
    sign_ = value(first_ + 1) > value(first_) ? 1 : -1;
  }

  // Where the edge between voxels first and first + 1 crosses `level`, as an index along the row.
  std::optional<double> crossing(double level) const {
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
      if (sign_ * step * (value(next) - value(i)) <= 0) return i;
      i = next;
    }
    return std::nullopt;
  }

  int length_, first_;
  int sign_ = 1;
  std::ptrdiff_t stride_;
  const std::int16_t* values_;
};

void refine(Eigen::Vector3d& vertex, const Volume& ct, double level) {
  int axis = -1;
  Eigen::Vector3i at;
  for (int a = 0; a < 3; ++a) {
    at[a] = static_cast<int>(std::floor(vertex[a]));
    const bool between = vertex[a] != at[a];
    if (between) axis = a;
    if (at[a] < 0 || at[a] + (between ? 1 : 0) >= ct.size[a]) return;
  }
  if (axis < 0) return;
  const std::optional<double> crossing = Row(ct, at, axis).crossing(level);
  if (!crossing) return;
  vertex[axis] = std::clamp(*crossing, at[axis] + kEdgeMargin, at[axis] + 1 - kEdgeMargin);
}

}  // namespace

void refine_crossings(TriangleMesh& mesh, const Volume& ct, double level) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.vertices.size(), 4096),
                    [&](const auto& block) {
                      for (std::size_t v = block.begin(); v < block.end(); ++v) {
                        refine(mesh.vertices[v], ct, level);
                      }
                    });
}

}  // namespace organbake
