// SPDX-License-Identifier: Apache-2.0
// The shell over a mesh: prisms over its faces, in which two barycentric weights and a height tell
// a place, and the way back from a place to them.
#include "organbake/geometry/prism.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/geometry/shell.h"

namespace organbake {
ShellMatrix shell_matrix(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& normals,
                         std::uint32_t face) {
  const auto [i, j, k] = proxy.faces[face];
  ShellMatrix m;
  m.col(0) = proxy.vertices[i];
  m.col(1) = proxy.vertices[j] - proxy.vertices[i];
  m.col(2) = proxy.vertices[k] - proxy.vertices[i];
  m.col(3) = normals[i];
  m.col(4) = normals[j] - normals[i];
  m.col(5) = normals[k] - normals[i];
  m.rightCols<3>().setZero();
  return m;
}

std::vector<ShellMatrix> shell_matrices(const TriangleMesh& proxy) {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  std::vector<ShellMatrix> matrices(proxy.faces.size());
  for (std::uint32_t f = 0; f < matrices.size(); ++f) matrices[f] = shell_matrix(proxy, normals, f);
  return matrices;
}

Eigen::Vector2d barycentric_at_height(const ShellMatrix& m, double h,
                                      const Eigen::Vector3d& point) {
  const Eigen::Vector3d e1 = m.col(1) + h * m.col(4);
  const Eigen::Vector3d e2 = m.col(2) + h * m.col(5);
  const Eigen::Vector3d d = point - m.col(0) - h * m.col(3);
  const double a = e1.dot(e1), b = e1.dot(e2), c = e2.dot(e2);
  const double determinant = a * c - b * b;
  if (!(std::abs(determinant) > 0)) return Eigen::Vector2d::Constant(1.0 / 3);  // a collapsed face
  const double r1 = e1.dot(d), r2 = e2.dot(d);
  return {(c * r1 - b * r2) / determinant, (a * r2 - b * r1) / determinant};
}

Eigen::Vector3d rejoined_point(const ShellMatrix& m, double h, const Eigen::Vector3d& point) {
  const Eigen::Vector2d b = barycentric_at_height(m, h, point);
  return shell_point(m, b.x(), b.y(), h);
}

namespace {

using Cubic = HeightCubic<double>;

// Closed forms lose digits near double roots and tiny leading coefficients; two Newton steps on the
// polynomial itself bring every simple root back to full precision.
double polished(const Cubic& f, double h) {
  for (int i = 0; i < 2; ++i) {
    const double slope = f.slope(h);
    if (slope == 0) break;
    h -= f.value(h) / slope;
  }
  return h;
}

int quadratic_roots(double a, double b, double c, std::array<double, 3>& roots) {
  const double discriminant = b * b - 4 * a * c;
  if (discriminant < 0) return 0;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  int count = 0;
  if (q != 0) roots[count++] = c / q;
  if (a != 0) roots[count++] = q / a;
  return count;
}

int cubic_roots(const Cubic& f, std::array<double, 3>& roots) {
  const double a = f.c2 / f.c3, b = f.c1 / f.c3, c = f.c0 / f.c3;
  const double q = (a * a - 3 * b) / 9, r = (2 * a * a * a - 9 * a * b + 27 * c) / 54;
  if (r * r < q * q * q) {
    const double theta = std::acos(std::clamp(r / std::sqrt(q * q * q), -1.0, 1.0));
    for (int k = 0; k < 3; ++k) {
      const double angle = (theta + 2 * std::numbers::pi * (k - 1)) / 3;
      roots[k] = -2 * std::sqrt(q) * std::cos(angle) - a / 3;
    }
    return 3;
  }
  // glibc's pow gives the same bits on every processor, its cbrt does not.
  const double root = std::pow(std::abs(r) + std::sqrt(r * r - q * q * q), 1.0 / 3);
  const double s = -std::copysign(root, r);
  roots[0] = s + (s != 0 ? q / s : 0) - a / 3;
  return 1;
}

// The root within ±limit of a cubic that is monotone there, or infinity when there is none.
double bracketed_root(const Cubic& f, double limit) {
  double low = -limit, high = limit;
  const bool rises = f.value(high) > f.value(low);
  if ((f.value(low) > 0) == rises || (f.value(high) < 0) == rises)
    return std::numeric_limits<double>::infinity();
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    ((f.value(middle) < 0) == rises ? low : high) = middle;
  }
}

// Newton from the plane of the face itself; for a cubic that is monotone within ±limit.
double monotone_root(const Cubic& f, double limit) {
  double h = std::clamp(-f.c0 / f.c1, -limit, limit);
  constexpr int kMostSteps = 12;  // three or four are the rule
  for (int i = 0; i < kMostSteps; ++i) {
    const double step = f.value(h) / f.slope(h);
    h = std::clamp(h - step, -2 * limit, 2 * limit);
    // Convergence is quadratic: after a step this small the next would not change a bit.
    if (std::abs(step) < 1e-9 * limit) return h;
  }
  return bracketed_root(f, limit);
}

// The rule, while |h| is small against the radius of curvature: at most one root within ±limit.
bool is_monotone(const Cubic& f, double limit) {
  return 2 * std::abs(f.c2) * limit + 3 * std::abs(f.c3) * limit * limit < std::abs(f.c1);
}

int all_roots(const Cubic& f, double limit, std::array<double, 3>& roots) {
  constexpr double kNegligible = 1e-12;  // the cubic term changes no bit that matters
  const double cube = std::abs(f.c3) * limit * limit;
  const int count = cube < kNegligible * (std::abs(f.c1) + std::abs(f.c2) * limit)
                        ? quadratic_roots(f.c2, f.c1, f.c0, roots)
                        : cubic_roots(f, roots);
  for (int i = 0; i < count; ++i) roots[i] = polished(f, roots[i]);
  return count;
}

}  // namespace

// S(b, h) is linear in h for fixed b, so the prism lies in the convex hull of its six corners.
PrismBounds prism_bounds(const ShellMatrix& m, double lowest_mm, double highest_mm) {
  std::array<Eigen::Vector3d, 6> corners;
  for (int c = 0; c < 3; ++c) {
    const double b1 = c == 1, b2 = c == 2;
    corners[2 * c] = shell_point(m, b1, b2, highest_mm);
    corners[2 * c + 1] = shell_point(m, b1, b2, lowest_mm);
  }
  PrismBounds bounds;
  const Eigen::Vector3d a = m.col(1), b = m.col(2), n = a.cross(b).normalized();
  bounds.direction = {n, -n, a.cross(n).normalized(), (b - a).cross(n).normalized(),
                      n.cross(b).normalized()};
  bounds.min = bounds.max = corners[0];
  bounds.extent.fill(-std::numeric_limits<double>::infinity());
  constexpr double kSlack = 1e-6;  // of the prism's size
  bounds.slack = kSlack * (corners[1] - corners[2]).norm();
  for (const auto& corner : corners) {
    bounds.min = bounds.min.cwiseMin(corner);
    bounds.max = bounds.max.cwiseMax(corner);
    for (std::size_t d = 0; d < bounds.direction.size(); ++d)
      bounds.extent[d] = std::max(bounds.extent[d], bounds.direction[d].dot(corner));
  }
  return bounds;
}

PrismCubic::PrismCubic(const ShellMatrix& m) : corner_(m.col(0)) {
  const Eigen::Vector3d e1 = m.col(1), e2 = m.col(2), n0 = m.col(3), n1 = m.col(4), n2 = m.col(5);
  slope0_ = e1.cross(e2);
  slope1_ = e1.cross(n2) + n1.cross(e2);
  slope2_ = n1.cross(n2);
  constant1_ = -n0.dot(slope0_);
  constant2_ = -n0.dot(slope1_);
  constant3_ = -n0.dot(slope2_);
}

PrismCubic::Roots PrismCubic::heights(const Eigen::Vector3d& point, double max_height) const {
  const Cubic f = at(point.x(), point.y(), point.z());
  Roots result;
  if (is_monotone(f, max_height)) {
    const double root = monotone_root(f, max_height);
    if (std::abs(root) <= max_height) result.heights[result.count++] = root;
    return result;
  }
  std::array<double, 3> roots{};
  const int count = all_roots(f, max_height, roots);
  for (int i = 0; i < count; ++i) {
    if (!(std::abs(roots[i]) <= max_height)) continue;
    int at = result.count++;
    for (; at > 0 && std::abs(result.heights[at - 1]) > std::abs(roots[i]); --at)
      result.heights[at] = result.heights[at - 1];
    result.heights[at] = roots[i];
  }
  return result;
}

}  // namespace organbake
