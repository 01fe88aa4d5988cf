// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geometry/mesh_checks.h"
#include "geometry/nearest_on_triangle.h"
#include "geometry/prism_bounds.h"
#include "geometry/prism_height.h"
#include "geometry/shell_map.h"

namespace organbake {
namespace {

// Side walls are shared by two prisms; this much outside still counts as in, so that rounding
// leaves no gap between neighbours.
constexpr double kWallTolerance = 1e-9;

bool in_triangle(double b1, double b2) {
  return b1 >= -kWallTolerance && b2 >= -kWallTolerance && b1 + b2 <= 1 + kWallTolerance;
}

// Where a proxy is folded flat the cubic vanishes and its roots mean nothing.
bool reproduces(const ShellMatrix& m, const ShellBinding& binding, const Eigen::Vector3d& point) {
  constexpr double kRounding = 1e-6;
  const double size = m.col(1).lpNorm<1>() + m.col(2).lpNorm<1>() + std::abs(binding.height_mm);
  const Eigen::Vector3d bound = shell_point(m, binding.b1, binding.b2, binding.height_mm);
  return (bound - point).lpNorm<1>() <= kRounding * size;
}

}  // namespace

struct ShellBinder::Impl {
  TriangleMesh proxy;
  double max_height_mm;
  double reach_mm;  // bounds heights of the fallback
  std::vector<ShellMatrix> matrices;
  std::vector<PrismCubic> cubics;
  std::vector<std::uint32_t> usable;  // faces with area
  std::vector<PrismBounds> prisms;    // of these faces

  // Uniform grid: faces of cell c are usable[i] for the i of
  // cell_faces[cell_start[c] … cell_start[c + 1]).
  Eigen::Vector3d grid_min;
  double cell_mm = 1;
  Eigen::Array3i cells = Eigen::Array3i::Ones();
  std::vector<std::uint32_t> cell_start, cell_faces;

  void build_grid();
  // Where the face's prism holds the point at a height smaller than the best yet, that is the best.
  void in_prism(std::uint32_t face, const Eigen::Vector3d& point, ShellBinding& best,
                double& best_height) const;
  ShellBinding unclamped(const Eigen::Vector3d& point) const;
  std::uint32_t nearest_face(const Eigen::Vector3d& point) const;
};

void ShellBinder::Impl::build_grid() {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (const std::uint32_t f : usable) {
    prisms.push_back(prism_bounds(matrices[f], -max_height_mm, max_height_mm));
    low = low.cwiseMin(prisms.back().min);
    high = high.cwiseMax(prisms.back().max);
  }
  grid_min = low;
  const Eigen::Vector3d extent = high - low;
  // About 48 cells along the longest side: cells of a few millimetres on an organ.
  constexpr double kCellsAlongLongest = 48;
  cell_mm = std::max(extent.maxCoeff() / kCellsAlongLongest, 1e-300);
  cells = (extent / cell_mm).array().floor().cast<int>() + 1;

  std::vector<std::vector<std::uint32_t>> lists(cells.prod());
  const double radius = 0.5 * std::sqrt(3.0) * cell_mm;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    const Eigen::Array3i first = ((prisms[i].min - low) / cell_mm).array().floor().cast<int>();
    const Eigen::Array3i last =
        ((prisms[i].max - low) / cell_mm).array().floor().cast<int>().min(cells - 1);
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          const Eigen::Vector3d center = low + cell_mm * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
          if (!prisms[i].touches_sphere(center, radius)) continue;
          lists[(std::size_t(z) * cells.y() + y) * cells.x() + x].push_back(
              static_cast<std::uint32_t>(i));
        }
      }
    }
  }
  cell_start.push_back(0);
  for (const auto& list : lists) {
    cell_faces.insert(cell_faces.end(), list.begin(), list.end());
    cell_start.push_back(static_cast<std::uint32_t>(cell_faces.size()));
  }
}

void ShellBinder::Impl::in_prism(std::uint32_t face, const Eigen::Vector3d& point,
                                 ShellBinding& best, double& best_height) const {
  const PrismCubic::Roots roots = cubics[face].heights(point, max_height_mm);
  for (int i = 0; i < roots.count && std::abs(roots.heights[i]) < best_height; ++i) {
    const Eigen::Vector2d b = barycentric_at_height(matrices[face], roots.heights[i], point);
    if (!in_triangle(b.x(), b.y())) continue;
    const ShellBinding found{face, b.x(), b.y(), roots.heights[i]};
    if (!reproduces(matrices[face], found, point)) continue;
    best = found;
    best_height = std::abs(found.height_mm);
    return;  // the others are larger
  }
}

std::uint32_t ShellBinder::Impl::nearest_face(const Eigen::Vector3d& point) const {
  double best = std::numeric_limits<double>::infinity();
  std::uint32_t face = usable.front();
  for (const std::uint32_t f : usable) {
    const auto [i, j, k] = proxy.faces[f];
    const Eigen::Vector3d &a = proxy.vertices[i], &b = proxy.vertices[j], &c = proxy.vertices[k];
    const Eigen::Vector3d w = nearest_on_triangle(point, a, b, c);
    const double d2 = (w[0] * a + w[1] * b + w[2] * c - point).squaredNorm();
    if (d2 < best) best = d2, face = f;
  }
  return face;
}

ShellBinding ShellBinder::Impl::unclamped(const Eigen::Vector3d& point) const {
  const std::uint32_t face = nearest_face(point);
  const ShellMatrix& m = matrices[face];
  const PrismCubic::Roots roots = cubics[face].heights(point, reach_mm);
  // Without a root nothing reproduces the point; the distance along the face's normal comes
  // nearest.
  const Eigen::Vector3d normal =
      Eigen::Vector3d(m.col(1)).cross(Eigen::Vector3d(m.col(2))).normalized();
  const double h = roots.count > 0 ? roots.heights[0] : normal.dot(point - m.col(0));
  const Eigen::Vector2d b = barycentric_at_height(m, h, point);
  return {face, b.x(), b.y(), h};
}

ShellBinder::ShellBinder(const TriangleMesh& proxy, double max_height_mm)
    : impl_(std::make_unique<Impl>()) {
  check_mesh(proxy, "proxy");
  impl_->proxy = proxy;
  impl_->max_height_mm = max_height_mm;
  impl_->reach_mm = 10 * (bounds(proxy).diagonal() + max_height_mm);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    impl_->matrices.push_back(shell_matrix(proxy, normals, f));
    impl_->cubics.emplace_back(impl_->matrices.back());
    if (face_area(proxy, f) > 0) impl_->usable.push_back(f);
  }
  if (impl_->usable.empty())
    throw BadDataError("proxy: has no face with an area, nothing can be bound");
  if (!(max_height_mm > 0) || !std::isfinite(max_height_mm)) {
    throw BadDataError("shell height must be a positive number of millimetres");
  }
  impl_->build_grid();
}

ShellBinder::~ShellBinder() = default;
ShellBinder::ShellBinder(ShellBinder&&) noexcept = default;

ShellBinding ShellBinder::bind(const Eigen::Vector3d& point) const {
  const Impl& s = *impl_;
  const Eigen::Array3d cell = ((point - s.grid_min) / s.cell_mm).array().floor();
  if ((cell >= 0).all() && (cell < s.cells.cast<double>()).all()) {
    const Eigen::Array3i c = cell.cast<int>();
    const std::size_t index = (std::size_t(c.z()) * s.cells.y() + c.y()) * s.cells.x() + c.x();
    ShellBinding best;
    double best_height = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = s.cell_start[index]; i < s.cell_start[index + 1]; ++i) {
      const std::uint32_t near = s.cell_faces[i];
      if (s.prisms[near].holds(point)) s.in_prism(s.usable[near], point, best, best_height);
    }
    if (std::isfinite(best_height)) return best;
  }
  return s.unclamped(point);
}

bool ShellBinder::inside(const ShellBinding& binding, const Eigen::Vector3d& point) const {
  return std::abs(binding.height_mm) <= impl_->max_height_mm &&
         in_triangle(binding.b1, binding.b2) &&
         reproduces(impl_->matrices[binding.face], binding, point);
}

}  // namespace organbake
