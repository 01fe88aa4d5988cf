// SPDX-License-Identifier: GPL-3.0-or-later
// What of a depth map takes part. Maps have far more pixels than independent measurements: cells of
// the view stand for them, each by the mean of the points about its median depth. Their normals are
// told from neighbours: of a plane, the depth's inverse is linear over the view, whatever its
// slant.
#include <algorithm>
#include <cmath>
#include <map>

#include "cost_functions/cost_functions.h"
#include "depth/depth_alignment.h"
#include "organbake/core/quantile.h"
#include "organbake/geometry/dense_solve.h"
#include "organbake/registration/register_photo.h"

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
  SeenDepth::Point mean;
  mean.trust = 0;
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

// Zero where the neighbours of one surface are too few.
Vector3d normal_of(const SeenDepth::Point& point,
                   const std::vector<const SeenDepth::Point*>& near) {
  constexpr double kOneSurface = 0.06;  // of the depth, from a cell to its neighbour
  constexpr Eigen::Index kFewest = 5;
  Eigen::Matrix<double, 9, 3> views;
  Eigen::Matrix<double, 9, 1> inverse_depths;
  Eigen::Index count = 0;
  for (const SeenDepth::Point* other : near) {
    const double z = other->place.z();
    if (std::abs(z / point.place.z() - 1) > kOneSurface) continue;
    views.row(count) = other->place.transpose() / z;
    inverse_depths[count++] = 1 / z;
  }
  if (count < kFewest) return Vector3d::Zero();
  const auto away = solve_least_squares(views.topRows(count), inverse_depths.head(count));
  return away ? Vector3d(-away->normalized()) : Vector3d::Zero();
}

void find_normals(SeenDepth& seen) {
  std::vector<const SeenDepth::Point*> by_cell(static_cast<std::size_t>(seen.columns) * seen.rows);
  for (const SeenDepth::Point& point : seen.points)
    by_cell[static_cast<std::size_t>(point.row) * seen.columns + point.column] = &point;
  for (SeenDepth::Point& point : seen.points) {
    std::vector<const SeenDepth::Point*> near;
    for (int y = std::max(0, point.row - 1); y <= std::min(seen.rows - 1, point.row + 1); ++y)
      for (int x = std::max(0, point.column - 1); x <= std::min(seen.columns - 1, point.column + 1);
           ++x)
        if (const auto* other = by_cell[static_cast<std::size_t>(y) * seen.columns + x])
          near.push_back(other);
    point.normal = normal_of(point, near);
  }
}

using Column7 = Eigen::Matrix<double, 7, 1>;
using Part = std::pair<int, int>;  // row, column

// Parts of the view along its longer side. Their number bounds how well they tell how much slopes
// vary, their size how far errors may reach.
constexpr int kParts = 10;

Eigen::MatrixXd variability(const std::map<Part, Column7>& slopes) {
  constexpr int kReach = 2;  // parts: from there on errors count as independent
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(7, 7);
  for (const auto& [a, slope] : slopes)
    for (int y = 1 - kReach; y < kReach; ++y)
      for (int x = 1 - kReach; x < kReach; ++x) {
        const auto other = slopes.find({a.first + y, a.second + x});
        if (other == slopes.end()) continue;
        const double share =
            (1 - std::abs(y) / double(kReach)) * (1 - std::abs(x) / double(kReach));
        sum += share * slope * other->second.transpose();
      }
  // What was fitted to them took some of their variation away.
  const double parts = static_cast<double>(slopes.size());
  return sum * parts / std::max(1.0, parts - 7);
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
  find_normals(seen);
  return seen;
}

// Robust weights of depth at a pose, and what it can be trusted with: the sandwich's two halves.

double CompositeEvidence::magnitude() const {
  Eigen::MatrixXd curvature = information;
  curvature.diagonal() *= 1 + 1e-9;
  const double excess = solve_symmetric(curvature, variability).trace();
  return static_cast<double>(information.rows()) / excess;
}

WeighedDepth weigh_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                         const DepthState& state) {
  constexpr double kCutoff = 3, kLargestNoise = 0.02;
  WeighedDepth weighed;
  weighed.matches = match_depth(surface, depth, state);
  weighed.noise =
      std::min(kLargestNoise, depth_noise(depth, weighed.matches, state, surface.center()));
  weighed.weights.assign(weighed.matches.size(), 0.0);
  const int side = std::max(1, std::max(depth.columns, depth.rows) / kParts);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(7, 7);
  std::map<Part, Column7> slopes;
  for (std::size_t i = 0; i < weighed.matches.size(); ++i) {
    if (weighed.matches[i].kind != DepthMatch::Kind::on) continue;
    const SeenDepth::Point& point = depth.points[i];
    const DepthRow row = depth_row(point, weighed.matches[i], state, surface.center());
    const double off = row.distance / (kCutoff * weighed.noise);
    const double weight = point.trust * robust_weight(off * off) / (weighed.noise * weighed.noise);
    weighed.weights[i] = weight;
    information += weight * row.slope * row.slope.transpose();
    auto& slope =
        slopes.try_emplace({point.row / side, point.column / side}, Column7::Zero()).first->second;
    slope += weight * row.distance * row.slope;
  }
  weighed.evidence = {information, variability(slopes)};
  const double magnitude = weighed.evidence.magnitude();
  weighed.trust = magnitude > 0 ? std::min(1.0, magnitude) : 0;
  return weighed;
}

}  // namespace organbake
