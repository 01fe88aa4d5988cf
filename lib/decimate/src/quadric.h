// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace organbake {

// Sum of weighted squared distances to planes (Garland & Heckbert 1997): xᵀA x + 2 bᵀx + c.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // A
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  static Quadric plane(const Eigen::Vector3d& unit_normal, const Eigen::Vector3d& point,
                       double weight) {
    const Eigen::Vector3d n = weight * unit_normal;
    const double d = -unit_normal.dot(point);
    return {n.x() * unit_normal.x(),
            n.x() * unit_normal.y(),
            n.x() * unit_normal.z(),
            n.y() * unit_normal.y(),
            n.y() * unit_normal.z(),
            n.z() * unit_normal.z(),
            d * n,
            weight * d * d};
  }

  Quadric& operator+=(const Quadric& o) {
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
    b += o.b;
    c += o.c;
    return *this;
  }

  Eigen::Vector3d times(const Eigen::Vector3d& p) const {
    return {xx * p.x() + xy * p.y() + xz * p.z(), xy * p.x() + yy * p.y() + yz * p.z(),
            xz * p.x() + yz * p.y() + zz * p.z()};
  }

  double at(const Eigen::Vector3d& p) const { return std::max(0.0, p.dot(times(p) + 2 * b) + c); }

  // The least point, drawn to `start` where the planes leave it free: (A + εI) d = −(A start + b).
  Eigen::Vector3d least_near(const Eigen::Vector3d& start) const {
    constexpr double kDraw = 1e-3;  // of A's trace
    const double e = kDraw * (xx + yy + zz);
    if (!(e > 0)) return start;
    const double a = xx + e, d = yy + e, f = zz + e;
    const double c0 = d * f - yz * yz, c1 = xz * yz - xy * f, c2 = xy * yz - xz * d;
    const double inverse = 1 / (a * c0 + xy * c1 + xz * c2);
    const Eigen::Vector3d r = -inverse * (times(start) + b);
    const double c4 = a * f - xz * xz, c5 = xy * xz - a * yz, c8 = a * d - xy * xy;
    return start + Eigen::Vector3d(c0 * r.x() + c1 * r.y() + c2 * r.z(),
                                   c1 * r.x() + c4 * r.y() + c5 * r.z(),
                                   c2 * r.x() + c5 * r.y() + c8 * r.z());
  }
};

}  // namespace organbake
