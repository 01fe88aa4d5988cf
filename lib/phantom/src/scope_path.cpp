// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/scope_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kFullTurn = 2 * std::numbers::pi;
constexpr double kTissue_mm = 58;  // its middle from the world's origin, along z

struct View {
  Vector3d eye, aim;
  double roll_rad = 0, zoom = 1;
};

View slide(double t) {
  const Vector3d eye(-28 + 56 * t, 3 * std::sin(kFullTurn * t), 2 * std::sin(0.8 * kFullTurn * t));
  return {eye, eye + Vector3d(3 * std::sin(kFullTurn * t), 2 * std::cos(kFullTurn * t), kTissue_mm),
          0.04 * std::sin(0.7 * kFullTurn * t)};
}

View approach(double t) {
  const Vector3d eye(3 * std::sin(0.9 * kFullTurn * t), 2 * std::sin(0.6 * kFullTurn * t),
                     -22 + 42 * t);
  return {eye, Vector3d(2, 2 * t, kTissue_mm), 0.05 * std::sin(0.5 * kFullTurn * t)};
}

View turn(double t) {
  const double yaw = 0.24 * std::sin(kFullTurn * t), pitch = 0.07 * (1 - std::cos(kFullTurn * t));
  return {Vector3d::Zero(), Vector3d(std::tan(yaw), std::tan(pitch), 1),
          0.1 * std::sin(0.5 * kFullTurn * t)};
}

View orbit(double t) {
  constexpr double kRadius_mm = 18;
  return {Vector3d(kRadius_mm * std::cos(kFullTurn * t), 0.7 * kRadius_mm * std::sin(kFullTurn * t),
                   3 * std::sin(kFullTurn * t)),
          Vector3d(0, 0, kTissue_mm), 0.06 * std::sin(kFullTurn * t)};
}

// Through knots by Catmull and Rom (1974).
Vector3d along(const std::array<Vector3d, 8>& knots, double t) {
  const int last = static_cast<int>(knots.size()) - 1;
  const double place = t * last;
  const int i = std::clamp(static_cast<int>(place), 0, last - 1);
  const double u = place - i;
  const auto knot = [&](int k) -> const Vector3d& { return knots[std::clamp(k, 0, last)]; };
  const Vector3d& a = knot(i - 1);
  const Vector3d& b = knot(i);
  const Vector3d& c = knot(i + 1);
  const Vector3d& d = knot(i + 2);
  return 0.5 * (2 * b + u * (c - a) + u * u * (2 * a - 5 * b + 4 * c - d) +
                u * u * u * (3 * b - a - 3 * c + d));
}

// Sideways, nearer, a turn to the other side, and back to the beginning.
View tour(double t) {
  static const std::array<Vector3d, 8> eyes = {
      Vector3d(-22, -4, -4), Vector3d(0, -6, 0), Vector3d(22, 0, 2), Vector3d(20, 4, 14),
      Vector3d(9, 8, 15),    Vector3d(5, 8, 13), Vector3d(-9, 2, 5), Vector3d(-22, -4, -4)};
  static const std::array<Vector3d, 8> aims = {
      Vector3d(-22, -2, 58), Vector3d(2, -4, 58),  Vector3d(22, 2, 58),   Vector3d(18, 8, 58),
      Vector3d(15, 12, 58),  Vector3d(-10, 2, 58), Vector3d(-18, -4, 58), Vector3d(-22, -2, 58)};
  return {along(eyes, t), along(aims, t), 0.08 * std::sin(kFullTurn * t)};
}

View view_along(ScopePath path, double t) {
  switch (path) {
    case ScopePath::slide:
      return slide(t);
    case ScopePath::approach:
      return approach(t);
    case ScopePath::turn:
      return turn(t);
    case ScopePath::orbit:
      return orbit(t);
    case ScopePath::tour:
      return tour(t);
    case ScopePath::zoom:
      return {Vector3d::Zero(), Vector3d(0, 0, kTissue_mm), 0, 1 + 0.8 * t};
    case ScopePath::still:
      break;
  }
  return {Vector3d::Zero(), Vector3d(0, 0, kTissue_mm)};
}

// What a hand adds to a scope that it moves.
Vector3d tremor_mm(double t) {
  return 0.2 * Vector3d(std::sin(9.3 * kFullTurn * t), std::sin(7.1 * kFullTurn * t + 1),
                        std::sin(5.7 * kFullTurn * t + 2));
}

}  // namespace

ScopePose scope_pose(ScopePath path, double share) {
  View view = view_along(path, share);
  const bool travels =
      path != ScopePath::still && path != ScopePath::turn && path != ScopePath::zoom;
  if (travels) view.eye += tremor_mm(share) - tremor_mm(0);
  const Vector3d up(std::sin(view.roll_rad), -std::cos(view.roll_rad), 0);
  return {look_at(view.eye, view.aim, up), view.zoom};
}

}  // namespace organbake
