// SPDX-License-Identifier: Apache-2.0
// Binding of points to the prisms of a shell. A uniform grid lists for each cell the prisms that
// reach into it; in each of these the height is a root of a cubic (prism.h). Points come in
// runs of neighbours, as maps have them, so that four of them are tried against one prism at once
// (prism_lanes.h).
#include "organbake/geometry/refine.h"
#include "organbake/geometry/shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/prism.h"
#include "prism_lanes.h"

namespace organbake {
namespace {

bool in_triangle(double b1, double b2) {
  return b1 >= -kWallTolerance && b2 >= -kWallTolerance && b1 + b2 <= 1 + kWallTolerance;
}

bool reproduces(const ShellMatrix& m, const ShellBinding& binding, const Eigen::Vector3d& point) {
  const double size = m.col(1).lpNorm<1>() + m.col(2).lpNorm<1>() + std::abs(binding.height_mm);
  const Eigen::Vector3d bound = shell_point(m, binding.b1, binding.b2, binding.height_mm);
  return (bound - point).lpNorm<1>() <= kRebindRounding * size;
}

// How far a binding leaves its face: by its height, and beside the triangle.
double stray_mm(const ShellMatrix& m, const ShellBinding& binding) {
  const double b0 = 1 - binding.b1 - binding.b2;
  const double beside = std::max({0.0, -b0, -binding.b1, -binding.b2});
  return std::abs(binding.height_mm) + beside * (m.col(1).norm() + m.col(2).norm());
}

}  // namespace

struct ShellBinder::Impl {
  TriangleMesh proxy;
  double max_height_mm;
  double beyond_max_height;  // the next number
  double reach_mm;           // bounds heights of the fallback
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
  std::span<const std::uint32_t> faces_of(std::size_t cell) const {
    if (cell + 1 >= cell_start.size()) return {};
    return std::span(cell_faces).subspan(cell_start[cell], cell_start[cell + 1] - cell_start[cell]);
  }
  // Of the cell that holds the point; a number beyond all where none does.
  std::size_t cell_of(const Eigen::Vector3d& point) const;
  // Up to kPrismLanes points.
  void bind_some(std::span<const Eigen::Vector3d> points, std::span<ShellBinding> bindings) const;
  // The bindings of the lanes `asked`, all in one cell.
  void search(std::size_t cell, const LanePoints& points, const LaneMask& asked,
              LaneBindings& best) const;
  void bind_alone(std::uint32_t face, const LanePoints& points, const LaneMask& asked,
                  LaneBindings& best) const;
  // Whether the face's triangle is about to collapse at the height: one that is rounded would say
  // nothing there.
  bool collapses_at(double height_mm, std::uint32_t face) const;
  bool carries(const ShellBinding& binding, const Eigen::Vector3d& point) const {
    return !collapses_at(binding.height_mm, binding.face) &&
           reproduces(matrices[binding.face], binding, point);
  }
  ShellBinding unclamped(const Eigen::Vector3d& point) const;
  // The place over a face, beside its triangle too, that gives the point back and leaves the face
  // least.
  struct Over {
    ShellBinding binding;
    double stray_mm = std::numeric_limits<double>::infinity();
    bool found() const { return std::isfinite(stray_mm); }
  };
  Over over(std::uint32_t face, const Eigen::Vector3d& point) const;
  struct Nearest {
    std::uint32_t face;
    double distance_mm;
  };
  Nearest nearest_face(const Eigen::Vector3d& point) const;
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

ShellBinder::Impl::Nearest ShellBinder::Impl::nearest_face(const Eigen::Vector3d& point) const {
  double best = std::numeric_limits<double>::infinity();
  std::uint32_t face = usable.front();
  for (const std::uint32_t f : usable) {
    const auto [i, j, k] = proxy.faces[f];
    const Eigen::Vector3d &a = proxy.vertices[i], &b = proxy.vertices[j], &c = proxy.vertices[k];
    const Eigen::Vector3d w = nearest_on_triangle(point, a, b, c);
    const double d2 = (w[0] * a + w[1] * b + w[2] * c - point).squaredNorm();
    if (d2 < best) best = d2, face = f;
  }
  return {face, std::sqrt(best)};
}

bool ShellBinder::Impl::collapses_at(double height_mm, std::uint32_t face) const {
  constexpr double kRounding = 1e-5;  // of the reach; stored heights are off by a tenth of it
  const ShellMatrix& m = matrices[face];
  const Eigen::Vector3d e1 = m.col(1) + height_mm * m.col(4), e2 = m.col(2) + height_mm * m.col(5);
  const double per_mm = m.col(4).norm() * e2.norm() + m.col(5).norm() * e1.norm();
  return !(e1.cross(e2).norm() > kRounding * reach_mm * per_mm);
}

ShellBinder::Impl::Over ShellBinder::Impl::over(std::uint32_t face,
                                                const Eigen::Vector3d& point) const {
  const PrismCubic::Roots roots = cubics[face].heights(point, reach_mm);
  Over best;
  for (int i = 0; i < roots.count; ++i) {
    const double h = roots.heights[i];
    const Eigen::Vector2d b = barycentric_at_height(matrices[face], h, point);
    const ShellBinding binding{face, b.x(), b.y(), h};
    if (!carries(binding, point)) continue;
    const double away_mm = stray_mm(matrices[face], binding);
    if (away_mm < best.stray_mm) best = {binding, away_mm};
  }
  return best;
}

ShellBinding ShellBinder::Impl::unclamped(const Eigen::Vector3d& point) const {
  // Beside a crease the nearest face's offset planes may meet a point only far from the face, and a
  // poke would fling it: then the face that it leaves least, of all, has it.
  constexpr double kFlung = 4;  // of the distance; lines that lean take up to twice of it
  const auto [nearest, distance_mm] = nearest_face(point);
  Over best = over(nearest, point);
  if (!(best.stray_mm <= kFlung * distance_mm)) {
    for (const std::uint32_t face : usable) {
      const Over other = over(face, point);
      if (other.stray_mm < best.stray_mm) best = other;
    }
  }
  if (best.found()) return best.binding;
  // Nothing reproduces the point; the distance along the face's normal comes nearest.
  const ShellMatrix& m = matrices[nearest];
  const Eigen::Vector3d normal =
      Eigen::Vector3d(m.col(1)).cross(Eigen::Vector3d(m.col(2))).normalized();
  const double h = normal.dot(point - m.col(0));
  const Eigen::Vector2d b = barycentric_at_height(m, h, point);
  return {nearest, b.x(), b.y(), h};
}

std::size_t ShellBinder::Impl::cell_of(const Eigen::Vector3d& point) const {
  const Eigen::Array3d cell = ((point - grid_min) / cell_mm).array().floor();
  if (!((cell >= 0).all() && (cell < cells.cast<double>()).all())) return cell_start.size() - 1;
  const Eigen::Array3i c = cell.cast<int>();
  return (std::size_t(c.z()) * cells.y() + c.y()) * cells.x() + c.x();
}

void ShellBinder::Impl::bind_some(std::span<const Eigen::Vector3d> points,
                                  std::span<ShellBinding> bindings) const {
  LanePoints lanes;
  LaneMask cell, waiting;
  for (std::size_t k = 0; k < kPrismLanes; ++k) {
    const Eigen::Vector3d& point = points[std::min(k, points.size() - 1)];
    lanes.x[k] = point.x(), lanes.y[k] = point.y(), lanes.z[k] = point.z();
    cell[k] = static_cast<std::int64_t>(cell_of(point));
    waiting[k] = k < points.size() ? -1 : 0;
  }
  LaneBindings best{};
  best.least_height += beyond_max_height;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!waiting[k]) continue;
    const LaneMask here = cell == cell[k];  // as a rule all of them
    search(static_cast<std::size_t>(cell[k]), lanes, here, best);
    waiting &= ~here;
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    bindings[k] = best.least_height[k] < beyond_max_height
                      ? ShellBinding{static_cast<std::uint32_t>(best.face[k]), best.b1[k],
                                     best.b2[k], best.height[k]}
                      : unclamped(points[k]);
  }
}

void ShellBinder::Impl::search(std::size_t cell, const LanePoints& points, const LaneMask& asked,
                               LaneBindings& best) const {
  for (const std::uint32_t near : faces_of(cell)) {
    const LaneMask held = asked & holds(prisms[near], points);
    if (!any(held)) continue;
    const std::uint32_t face = usable[near];
    const LaneMask open = bind_lanes(matrices[face], cubics[face], face, points, held, best);
    if (any(open)) bind_alone(face, points, open, best);
  }
}

void ShellBinder::Impl::bind_alone(std::uint32_t face, const LanePoints& points,
                                   const LaneMask& asked, LaneBindings& best) const {
  for (std::size_t k = 0; k < kPrismLanes; ++k) {
    if (!asked[k]) continue;
    const Eigen::Vector3d point(points.x[k], points.y[k], points.z[k]);
    const PrismCubic::Roots roots = cubics[face].heights(point, best.least_height[k]);
    for (int i = 0; i < roots.count && std::abs(roots.heights[i]) < best.least_height[k]; ++i) {
      const double h = roots.heights[i];
      const Eigen::Vector2d b = barycentric_at_height(matrices[face], h, point);
      if (!in_triangle(b.x(), b.y())) continue;
      if (!carries({face, b.x(), b.y(), h}, point)) continue;
      best.least_height[k] = std::abs(h);
      best.b1[k] = b.x(), best.b2[k] = b.y(), best.height[k] = h;
      best.face[k] = face;
    }
  }
}

ShellBinder::ShellBinder(const TriangleMesh& proxy, double max_height_mm)
    : impl_(std::make_unique<Impl>()) {
  check_mesh(proxy, "proxy");
  impl_->proxy = proxy;
  impl_->max_height_mm = max_height_mm;
  impl_->beyond_max_height = std::nextafter(max_height_mm, std::numeric_limits<double>::infinity());
  impl_->reach_mm = 10 * (bounds(proxy).diagonal() + max_height_mm);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    impl_->matrices.push_back(shell_matrix(proxy, normals, f));
    impl_->cubics.emplace_back(impl_->matrices.back());
    if (face_area(proxy, f) > 0) impl_->usable.push_back(f);
  }
  if (impl_->usable.empty())
    throw BadDataError("proxy: has no face with an area, nothing can be bound");
  if (!(max_height_mm > 0) || !std::isfinite(max_height_mm))
    throw BadDataError("shell height must be a positive number of millimetres");
  impl_->build_grid();
}

ShellBinder::~ShellBinder() = default;
ShellBinder::ShellBinder(ShellBinder&&) noexcept = default;

ShellBinding ShellBinder::bind(const Eigen::Vector3d& point) const {
  ShellBinding binding;
  bind({&point, 1}, {&binding, 1});
  return binding;
}

void ShellBinder::bind(std::span<const Eigen::Vector3d> points,
                       std::span<ShellBinding> bindings) const {
  for (std::size_t first = 0; first < points.size(); first += kPrismLanes) {
    const std::size_t count = std::min(kPrismLanes, points.size() - first);
    impl_->bind_some(points.subspan(first, count), bindings.subspan(first, count));
  }
}

bool ShellBinder::gives_back(std::uint32_t face, double height_mm, const Eigen::Vector3d& point,
                             double within_mm) const {
  return (rejoined_point(impl_->matrices[face], height_mm, point) - point).norm() <= within_mm;
}

bool ShellBinder::inside(const ShellBinding& binding, const Eigen::Vector3d& point) const {
  return std::abs(binding.height_mm) <= impl_->max_height_mm &&
         in_triangle(binding.b1, binding.b2) &&
         reproduces(impl_->matrices[binding.face], binding, point);
}

}  // namespace organbake
