// SPDX-License-Identifier: Apache-2.0
// Binds four points at a time in the prism over a face: the height solves a cubic, by Newton's
// method, and then the place in the face follows. Points for which the cubic may have several roots
// are handed back to the caller, which solves each exactly.
#include "prism_lanes.h"

namespace organbake {
namespace {

Vec4d dot(const LanePoints& a, const LanePoints& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
// a + h · b
LanePoints along(const Eigen::Vector3d& a, const Vec4d& h, const Eigen::Vector3d& b) {
  return {a.x() + h * b.x(), a.y() + h * b.y(), a.z() + h * b.z()};
}
Vec4d magnitude(const Vec4d& a) { return a < 0 ? -a : a; }
Vec4d clamped(const Vec4d& a, const Vec4d& limit) {
  const Vec4d low = a < -limit ? -limit : a;
  return low > limit ? limit : low;
}

struct LaneCubic : HeightCubic<Vec4d> {
  // At least half the second derivative, up to ±h.
  Vec4d bend(const Vec4d& h) const { return magnitude(c2) + 3 * std::abs(c3) * magnitude(h); }
  // Certainly, up to ±reach.
  LaneMask monotone(const Vec4d& reach) const {
    return reach * (2 * magnitude(c2) + 3 * std::abs(c3) * reach) < magnitude(c1);
  }
};

struct HeightRoots {
  Vec4d height;
  LaneMask found;    // no other is nearer to 0
  LaneMask unknown;  // whether there is one of less than `below`
};

// Newton from the second-order guess. Where the cubic is monotone up to `below` on both sides, no
// other root matters, and none at all where it keeps its sign. Where it is so up to twice the root,
// no other is nearer, and the slope is half of what it is at 0 or more: the face's triangle is far
// from closing there, where a rounded height would say nothing.
HeightRoots nearest_roots(const LaneCubic& cubic, const Vec4d& below, const LaneMask& asked) {
  const LaneMask none =
      cubic.monotone(below) & (cubic.value(below) * cubic.value(-below) > 0) & asked;
  LaneMask going = asked & ~none;
  const Vec4d linear = -cubic.c0 / cubic.c1;
  Vec4d h = clamped(linear * (1 - linear * (cubic.c2 / cubic.c1)), below);
  constexpr int kMostSteps = 8;  // two are the rule
  for (int i = 0; i < kMostSteps && any(going); ++i) {
    const Vec4d slope = cubic.slope(h), step = cubic.value(h) / slope;
    h = going ? clamped(h - step, 2 * below) : h;
    // Quadratic convergence: what is left is less than this over the slope.
    constexpr double kExact = 1e-12;  // of `below`
    going &= ~(cubic.bend(h) * step * step <= kExact * below * magnitude(slope));
  }
  const Vec4d twice = 2 * magnitude(h), reach = twice < below ? twice : below;
  const LaneMask found = asked & ~none & ~going & cubic.monotone(reach);
  return {h, found, asked & ~none & ~found};
}

}  // namespace

LaneMask bind_lanes(const ShellMatrix& m, const PrismCubic& cubic, std::uint32_t face,
                    const LanePoints& points, const LaneMask& asked, LaneBindings& best) {
  const auto [h, found, unknown] =
      nearest_roots({cubic.at(points.x, points.y, points.z)}, best.least_height, asked);
  if (!any(found)) return unknown;
  const Vec4d size = magnitude(h);
  const LanePoints e1 = along(m.col(1), h, m.col(4)), e2 = along(m.col(2), h, m.col(5));
  const LanePoints base = along(m.col(0), h, m.col(3));
  const LanePoints d = {points.x - base.x, points.y - base.y, points.z - base.z};
  const Vec4d a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2);
  const Vec4d scale = 1 / (a * c - b * b);  // infinite for a collapsed face: nothing holds then
  const Vec4d r1 = dot(e1, d), r2 = dot(e2, d);
  const Vec4d b1 = (c * r1 - b * r2) * scale, b2 = (a * r2 - b * r1) * scale;
  const Vec4d off = magnitude(d.x - b1 * e1.x - b2 * e2.x) +
                    magnitude(d.y - b1 * e1.y - b2 * e2.y) + magnitude(d.z - b1 * e1.z - b2 * e2.z);
  const double face_size = m.col(1).lpNorm<1>() + m.col(2).lpNorm<1>();
  const LaneMask better = found & (size < best.least_height) & (b1 >= -kWallTolerance) &
                          (b2 >= -kWallTolerance) & (b1 + b2 <= 1 + kWallTolerance) &
                          (off <= kRebindRounding * (face_size + size));
  best.least_height = better ? size : best.least_height;
  best.b1 = better ? b1 : best.b1;
  best.b2 = better ? b2 : best.b2;
  best.height = better ? h : best.height;
  best.face = better ? best.face * 0 + face : best.face;
  return unknown;
}

}  // namespace organbake
