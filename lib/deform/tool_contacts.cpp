// SPDX-License-Identifier: Apache-2.0
#include "deform/tool_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace organbake::deform {
namespace {

using Eigen::Vector3d;

constexpr int kRounds = 32;
constexpr double kTouching = 1e-9;  // of both radii

double share_of(double part, double whole) {
  return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0;
}

// Moves two tips apart until they touch; false when they lie apart already.
bool part(InstrumentTip& a, InstrumentTip& b) {
  const auto [s, t] = nearest_on_segments(a.position_mm, a.axis_mm, b.position_mm, b.axis_mm);
  const Vector3d way = (b.position_mm + t * b.axis_mm) - (a.position_mm + s * a.axis_mm);
  const double distance = way.norm(), together = a.radius_mm + b.radius_mm;
  const double overlap = together - distance;
  if (!(overlap > kTouching * together)) return false;
  // Axes that cross tell no way out; any across both will do.
  Vector3d out = way;
  if (!(distance > kTouching * together)) {
    out = a.axis_mm.cross(b.axis_mm);
    if (out.isZero(0)) out = a.axis_mm.isZero(0) ? Vector3d::UnitX() : a.axis_mm.unitOrthogonal();
  }
  out.normalize();
  a.position_mm -= overlap / 2 * out;
  b.position_mm += overlap / 2 * out;
  return true;
}

}  // namespace

// Ericson, Real-Time Collision Detection (2005), 5.1.9.
NearestOnSegments nearest_on_segments(const Vector3d& first_at, const Vector3d& first_way,
                                      const Vector3d& second_at, const Vector3d& second_way) {
  const Vector3d between = first_at - second_at;
  const double a = first_way.squaredNorm(), b = first_way.dot(second_way),
               e = second_way.squaredNorm(), c = first_way.dot(between),
               f = second_way.dot(between);
  double s = share_of(b * f - c * e, a * e - b * b);
  double t = share_of(b * s + f, e);
  s = share_of(b * t - c, a);
  return {s, t};
}

std::vector<InstrumentTip> held_apart(std::vector<InstrumentTip> tips) {
  for (int round = 0; round < kRounds; ++round) {
    bool any = false;
    for (std::size_t i = 0; i < tips.size(); ++i) {
      for (std::size_t j = i + 1; j < tips.size(); ++j) {
        if (tips[i].active && tips[j].active && part(tips[i], tips[j])) any = true;
      }
    }
    if (!any) break;
  }
  return tips;
}

}  // namespace organbake::deform
