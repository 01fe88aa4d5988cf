// SPDX-License-Identifier: GPL-3.0-or-later
#include "crossing_instrument.h"

#include <cmath>
#include <numbers>

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_mm = CrossingInstrument::kDiameter_mm / 2;

// The nearer crossing of a sphere; nothing where there is none in front.
std::optional<double> sphere_hit(const Vector3d& from_center, const Vector3d& ray) {
  const double a = ray.squaredNorm(), b = ray.dot(from_center);
  const double root2 = b * b - a * (from_center.squaredNorm() - kRadius_mm * kRadius_mm);
  if (root2 < 0) return {};
  const double t = (-b - std::sqrt(root2)) / a;
  return t > 0 ? std::optional(t) : std::nullopt;
}

}  // namespace

CrossingInstrument::CrossingInstrument(double share) : port_(115, 42, 18) {
  constexpr double kComes = 0.3, kGone = 0.7;
  const double passed = (share - kComes) / (kGone - kComes);
  inside_ = passed > 0 && passed < 1;
  const double depth = inside_ ? std::sin(std::numbers::pi * passed) : 0;
  const Vector3d outside(80, 26, 34);
  const Vector3d over(2, 26 - 32 * passed, 47);
  tip_ = outside + depth * (over - outside);
}

std::optional<CrossingInstrument::Hit> CrossingInstrument::first_hit(const Vector3d& origin,
                                                                     const Vector3d& ray) const {
  if (!inside_) return {};
  const Vector3d axis = (port_ - tip_).normalized(), from_tip = origin - tip_;
  // The shaft: a cylinder of which only what lies behind the tip's ball is there.
  const Vector3d across = ray - ray.dot(axis) * axis;
  const Vector3d beside = from_tip - from_tip.dot(axis) * axis;
  const double a = across.squaredNorm(), b = across.dot(beside);
  const double root2 = b * b - a * (beside.squaredNorm() - kRadius_mm * kRadius_mm);
  if (root2 < 0) return {};  // whatever misses the endless cylinder misses the ball within it
  if (a > 0) {
    const double t = (-b - std::sqrt(root2)) / a;
    if (t > 0 && (from_tip + t * ray).dot(axis) >= 0)
      return Hit{t, (beside + t * across) / kRadius_mm};
  }
  const std::optional<double> ball = sphere_hit(from_tip, ray);
  if (!ball) return {};
  return Hit{*ball, (from_tip + *ball * ray) / kRadius_mm};
}

}  // namespace organbake
