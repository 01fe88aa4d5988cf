// SPDX-License-Identifier: GPL-3.0-or-later
// Depth maps have far more pixels than independent measurements: cells of the view stand for them,
// each by the mean of the points about its median depth.
#include "organbake/registration/seen_depth.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/median.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCells = 1500;
constexpr double kStep = 0.02;  // of the depth: farther from the median is another surface
constexpr double kOneSurfaceShare = 0.6;  // of a cell's points that lie on one surface
constexpr double kLeastFilled = 0.3;      // of the points that a usual cell has

bool counts(const Vector3d& p) { return p.allFinite() && p.z() > 0; }

// The cells of the view that the points fill.
struct ViewGrid {
  Vector2d low = Vector2d::Constant(1e300), high = Vector2d::Constant(-1e300);
  int columns = 0, rows = 0;

  explicit ViewGrid(const std::vector<Vector3d>& points) {
    for (const Vector3d& p : points) {
      if (!counts(p)) continue;
      low = low.cwiseMin(p.head<2>() / p.z());
      high = high.cwiseMax(p.head<2>() / p.z());
    }
    const Vector2d size = high - low;
    if (!(size.x() > 0 && size.y() > 0)) return;
    columns = std::clamp(static_cast<int>(std::sqrt(kCells * size.x() / size.y())), 1, 1000);
    rows = std::clamp(static_cast<int>(kCells / columns), 1, 1000);
  }
  std::size_t cell(const Vector3d& p) const {
    const Vector2d at = (p.head<2>() / p.z() - low).cwiseQuotient(high - low);
    const int x = std::clamp(static_cast<int>(at.x() * columns), 0, columns - 1);
    const int y = std::clamp(static_cast<int>(at.y() * rows), 0, rows - 1);
    return static_cast<std::size_t>(y) * columns + x;
  }
};

// Nothing (trust 0) where the cell's points lie on no one surface.
SeenDepth::Point mean_about_median(const std::vector<Vector3d>& points,
                                   const std::vector<float>& trust,
                                   const std::vector<std::size_t>& cell) {
  std::vector<double> depths;
  for (const std::size_t i : cell) depths.push_back(points[i].z());
  const double middle = median(std::move(depths));
  SeenDepth::Point mean{Vector3d::Zero(), 0};
  double weights = 0, near = 0;
  for (const std::size_t i : cell) {
    if (std::abs(points[i].z() / middle - 1) > kStep) continue;
    const double weight = trust.empty() ? 1 : std::clamp<double>(trust[i], 0, 1);
    mean.place += weight * points[i];
    weights += weight;
    ++near;
  }
  if (near < kOneSurfaceShare * static_cast<double>(cell.size()) || !(weights > 0)) return mean;
  mean.place /= weights;
  mean.trust = weights / near;
  return mean;
}

}  // namespace

SeenDepth thin_depth(const std::vector<Vector3d>& points, const std::vector<float>& trust,
                     bool relative) {
  const ViewGrid grid(points);
  SeenDepth seen{{}, grid.columns, grid.rows, relative};
  if (grid.columns == 0) return seen;
  std::vector<std::vector<std::size_t>> cells(static_cast<std::size_t>(grid.columns) * grid.rows);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (counts(points[i])) cells[grid.cell(points[i])].push_back(i);
  std::vector<std::size_t> filled;
  for (const auto& cell : cells)
    if (!cell.empty()) filled.push_back(cell.size());
  const double least = kLeastFilled * static_cast<double>(median(std::move(filled)));
  for (std::size_t c = 0; c < cells.size(); ++c) {
    if (cells[c].empty() || static_cast<double>(cells[c].size()) < least) continue;
    SeenDepth::Point point = mean_about_median(points, trust, cells[c]);
    if (!(point.trust > 0)) continue;
    point.column = static_cast<int>(c) % grid.columns;
    point.row = static_cast<int>(c) / grid.columns;
    seen.points.push_back(point);
  }
  return seen;
}

}  // namespace organbake
