// SPDX-License-Identifier: Apache-2.0
#include "geometry/prism_height.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace organbake {
namespace {

struct Cubic {
  double c0, c1, c2, c3;
  double value(double h) const { return c0 + h * (c1 + h * (c2 + h * c3)); }
  double slope(double h) const { return c1 + h * (2 * c2 + h * 3 * c3); }
};

// det[E1 + h N1, E2 + h N2, D − h N0] in powers of h.
Cubic coplanarity(const ShellMatrix& m, const Eigen::Vector3d& point) {
  const Eigen::Vector3d d = point - m.col(0), e1 = m.col(1), e2 = m.col(2);
  const Eigen::Vector3d n0 = m.col(3), n1 = m.col(4), n2 = m.col(5);
  const Eigen::Vector3d e12 = e1.cross(e2), n12 = n1.cross(n2);
  const Eigen::Vector3d mixed = e1.cross(n2) + n1.cross(e2);
  return {d.dot(e12), d.dot(mixed) - n0.dot(e12), d.dot(n12) - n0.dot(mixed), -n0.dot(n12)};
}

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
  const double s = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(r * r - q * q * q)), r);
  roots[0] = s + (s != 0 ? q / s : 0) - a / 3;
  return 1;
}

}  // namespace

PrismHeights prism_heights(const ShellMatrix& m, const Eigen::Vector3d& point, double max_height) {
  const Cubic f = coplanarity(m, point);
  PrismHeights result;
  // Most points lie near the root that Newton finds from the plane of the face itself: the cubic is
  // nearly linear while |h| is small against the radius of curvature.
  std::array<double, 3> roots{};
  const double h = max_height;
  const double linear = std::abs(f.c1) * h, square = std::abs(f.c2) * h * h,
               cube = std::abs(f.c3) * h * h * h;
  int count = 0;
  if (2 * square + 3 * cube < linear) {  // monotone within ±max_height: at most one root there
    double root = std::clamp(-f.c0 / f.c1, -h, h);
    constexpr int kMostSteps = 20;
    for (int i = 0; i < kMostSteps; ++i) {
      const double step = f.value(root) / f.slope(root);
      root = std::clamp(root - step, -2 * h, 2 * h);
      if (std::abs(step) < 1e-14 * h) break;
    }
    roots[count++] = root;
  } else if (cube < 1e-12 * (linear + square)) {
    count = quadratic_roots(f.c2, f.c1, f.c0, roots);
  } else {
    count = cubic_roots(f, roots);
  }
  for (int i = 0; i < count; ++i) {
    const double root = polished(f, roots[i]);
    if (!(std::abs(root) <= max_height)) continue;
    int at = result.count++;
    for (; at > 0 && std::abs(result.heights[at - 1]) > std::abs(root); --at) {
      result.heights[at] = result.heights[at - 1];
    }
    result.heights[at] = root;
  }
  return result;
}

}  // namespace organbake
