// SPDX-License-Identifier: GPL-3.0-or-later
// Charts by growing over faces of like direction, laid flat along one axis and cut where they would
// lie over themselves; and shelf packing, the tallest first, at the largest scale that fits.
#include "charts.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <unordered_map>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastCosine = 0.6427876096865394;  // of 50°
constexpr std::uint32_t kNoChart = 0xFFFFFFFFu;
constexpr double kCellsPerEdge = 3;  // of the grid that finds faces over each other
// The axis of a chart looks along the mean normal of this share of the whole surface.
constexpr double kSeedShare = 0.02;

// Faces across each face's three edges; kNoChart at a border and where three or more meet.
std::vector<std::array<std::uint32_t, 3>> faces_across(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> twins = half_edge_twins(mesh);
  std::vector<std::array<std::uint32_t, 3>> across(mesh.faces.size());
  for (std::uint32_t h = 0; h < twins.size(); ++h)
    across[h / 3][h % 3] = twins[h] == kNoHalfEdge ? kNoChart : twins[h] / 3;
  return across;
}

// Which cells of a plane are covered, to find faces that would lie over each other.
class FlatGrid {
 public:
  explicit FlatGrid(double cell_mm) : cell_mm_(cell_mm) {}

  // False, and nothing taken, when the triangle covers the middle of a cell that is taken.
  bool take(const std::array<Vector2d, 3>& triangle) {
    std::vector<std::uint64_t> cells;
    Vector2d low = triangle[0], high = triangle[0];
    for (const Vector2d& p : triangle) low = low.cwiseMin(p), high = high.cwiseMax(p);
    for (auto y = column(low.y()); y <= column(high.y()); ++y)
      for (auto x = column(low.x()); x <= column(high.x()); ++x) {
        const Vector2d middle = cell_mm_ * Vector2d(double(x) + 0.5, double(y) + 0.5);
        if (!inside(triangle, middle)) continue;
        cells.push_back((std::uint64_t(std::uint32_t(x)) << 32) | std::uint32_t(y));
        if (taken_.contains(cells.back())) return false;
      }
    for (const std::uint64_t cell : cells) taken_.emplace(cell, true);
    return true;
  }

 private:
  std::int64_t column(double at) const { return std::int64_t(std::floor(at / cell_mm_)); }
  static double side(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
    return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
  }
  static bool inside(const std::array<Vector2d, 3>& t, const Vector2d& p) {
    return side(t[0], t[1], p) > 0 && side(t[1], t[2], p) > 0 && side(t[2], t[0], p) > 0;
  }

  double cell_mm_;
  std::unordered_map<std::uint64_t, bool> taken_;
};

class ChartCutter {
 public:
  explicit ChartCutter(const TriangleMesh& mesh)
      : mesh_(mesh),
        across_(faces_across(mesh)),
        chart_(mesh.faces.size(), kNoChart),
        cell_mm_(mean_edge_length(mesh) / kCellsPerEdge),
        seed_area_mm2_(kSeedShare * surface_area(mesh)) {
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      normals_.push_back(face_normal(mesh, f));
      areas_.push_back(face_area(mesh, f));
    }
  }

  std::vector<Chart> run() {
    // The next chart begins beside the ones that are there, so that no slivers stay between them.
    std::queue<std::uint32_t> beside;
    for (std::uint32_t first = 0; first < chart_.size(); ++first) {
      beside.push(first);
      while (!beside.empty()) {
        const std::uint32_t seed = beside.front();
        beside.pop();
        if (chart_[seed] != kNoChart || !(areas_[seed] > 0)) continue;
        charts_.push_back(grown(seed));
        for (const std::uint32_t face : charts_.back().faces)
          for (const std::uint32_t next : across_[face])
            if (next != kNoChart && chart_[next] == kNoChart) beside.push(next);
      }
    }
    for (Chart& chart : charts_) lay_along(chart);
    return std::move(charts_);
  }

 private:
  // Breadth first over free faces that `belongs` takes.
  template <typename Belongs>
  std::vector<std::uint32_t> reached(std::uint32_t seed, const Belongs& belongs) const {
    std::vector<std::uint32_t> faces = {seed};
    std::unordered_map<std::uint32_t, bool> seen = {{seed, true}};
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (const std::uint32_t next : across_[faces[i]]) {
        if (next == kNoChart || chart_[next] != kNoChart || !(areas_[next] > 0)) continue;
        if (!seen.emplace(next, true).second || !belongs(next)) continue;
        faces.push_back(next);
      }
    }
    return faces;
  }

  // The mean normal of the free surface round the seed, or the seed's own where that turns away.
  Vector3d axis_at(std::uint32_t seed) const {
    Vector3d sum = Vector3d::Zero();
    double area = 0;
    for (const std::uint32_t face : reached(seed, [&](std::uint32_t next) {
           area += areas_[next];
           return area < seed_area_mm2_ && normals_[next].dot(normals_[seed]) > kLeastCosine;
         }))
      sum += areas_[face] * normals_[face];
    const Vector3d mean = sum.normalized();
    return mean.dot(normals_[seed]) > kLeastCosine ? mean : normals_[seed];
  }

  Chart grown(std::uint32_t seed) {
    Chart chart;
    chart.axis = axis_at(seed);
    chart.u = chart.axis.unitOrthogonal();
    chart.v = chart.axis.cross(chart.u);
    FlatGrid grid(cell_mm_);
    grid.take(flat(chart, seed));
    chart.faces = reached(seed, [&](std::uint32_t next) {
      return normals_[next].dot(chart.axis) > kLeastCosine && grid.take(flat(chart, next));
    });
    for (const std::uint32_t face : chart.faces)
      chart_[face] = static_cast<std::uint32_t>(charts_.size());
    return chart;
  }

  std::array<Vector2d, 3> flat(const Chart& chart, std::uint32_t face) const {
    const Face& f = mesh_.faces[face];
    return {chart.flat(mesh_.vertices[f[0]]), chart.flat(mesh_.vertices[f[1]]),
            chart.flat(mesh_.vertices[f[2]])};
  }

  // Turns u and v along the chart's extents.
  void lay_along(Chart& chart) const {
    Vector2d mean = Vector2d::Zero();
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    std::vector<Vector2d> points;
    for (const std::uint32_t face : chart.faces)
      for (const Vector2d& p : flat(chart, face)) points.push_back(p), mean += p;
    mean /= static_cast<double>(points.size());
    for (const Vector2d& p : points) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread);
    const Vector2d longest = solver.eigenvectors().col(1);
    chart.u = (longest.x() * chart.u + longest.y() * chart.v).normalized();
    chart.v = chart.axis.cross(chart.u);
  }

  const TriangleMesh& mesh_;
  std::vector<std::array<std::uint32_t, 3>> across_;
  std::vector<std::uint32_t> chart_;
  double cell_mm_, seed_area_mm2_;
  std::vector<Vector3d> normals_;
  std::vector<double> areas_;
  std::vector<Chart> charts_;
};

// Whether all fit; `corners` then says where.
bool shelved(const std::vector<Eigen::Vector2d>& sizes, double scale, int margin, int side,
             std::vector<Eigen::Vector2i>& corners) {
  std::vector<Eigen::Vector2i> cells;
  for (const Eigen::Vector2d& size : sizes)
    cells.push_back((scale * size).array().ceil().cast<int>().matrix() +
                    Eigen::Vector2i::Constant(2 * margin));
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return cells[a].y() > cells[b].y(); });
  corners.resize(sizes.size());
  int left = 0, top = 0, shelf = 0;
  for (const std::size_t i : order) {
    if (left + cells[i].x() > side) left = 0, top += shelf, shelf = 0;
    shelf = std::max(shelf, cells[i].y());
    if (left + cells[i].x() > side || top + shelf > side) return false;
    corners[i] = {left + margin, top + margin};
    left += cells[i].x();
  }
  return true;
}

}  // namespace

std::vector<Chart> cut_into_charts(const TriangleMesh& mesh) { return ChartCutter(mesh).run(); }

PackedRectangles pack_rectangles(const std::vector<Eigen::Vector2d>& sizes, int margin, int side,
                                 double largest_scale) {
  PackedRectangles packed;
  if (shelved(sizes, largest_scale, margin, side, packed.corners)) {
    packed.scale = largest_scale;
    return packed;
  }
  constexpr int kHalvings = 24;
  double fits = 0, too_large = largest_scale;
  for (int i = 0; i < kHalvings; ++i) {
    const double scale = 0.5 * (fits + too_large);
    std::vector<Eigen::Vector2i> corners;
    if (shelved(sizes, scale, margin, side, corners)) {
      fits = scale;
      packed.corners = std::move(corners);
    } else {
      too_large = scale;
    }
  }
  packed.scale = fits;
  return packed;
}

}  // namespace organbake
