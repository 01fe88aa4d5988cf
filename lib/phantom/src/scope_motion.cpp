// SPDX-License-Identifier: GPL-3.0-or-later
// How a scope moves along its paths, what a sensor makes of the light while it does, and the shaft
// that crosses before it.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "formulas.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"

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

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kVignette = 0.05;  // of the light, at the picture's farther border

Vector3f between_pixels(const SensorLight& light, const Vector2d& pixel) {
  const double x = std::clamp(pixel.x() - 0.5, 0.0, light.width - 1.001);
  const double y = std::clamp(pixel.y() - 0.5, 0.0, light.height - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const auto u = static_cast<float>(x - column), v = static_cast<float>(y - row);
  const Vector3f* p = &light.radiance[static_cast<std::size_t>(row) * light.width + column];
  return (1 - v) * ((1 - u) * p[0] + u * p[1]) +
         v * ((1 - u) * p[light.width] + u * p[light.width + 1]);
}

// sRGB's curve as a table, for speed; within 1e-4.
double encoded(double linear) {
  constexpr int kSteps = 4096;
  static const std::array<float, kSteps + 2> table = [] {
    std::array<float, kSteps + 2> values{};
    for (int i = 0; i < kSteps + 2; ++i)
      values[i] = srgb_from_linear(static_cast<float>(i) / kSteps);
    return values;
  }();
  const double place = kSteps * std::clamp(linear, 0.0, 1.0);
  const int i = static_cast<int>(place);
  return table[i] + (place - i) * (table[i + 1] - table[i]);
}

}  // namespace

SensorLight blurred_by_turn(const SensorLight& light, const Intrinsics& lens,
                            const Vector2d& turn_rad) {
  const int steps = static_cast<int>(turn_rad.norm() * std::max(lens.fx, lens.fy)) + 2;
  std::vector<Eigen::Matrix3d> turns;
  for (int i = 0; i < steps; ++i) {
    const Vector2d turn = ((i + 0.5) / steps - 0.5) * turn_rad;
    turns.push_back(Eigen::AngleAxisd(turn.norm(), Vector3d(turn.x(), turn.y(), 0).normalized())
                        .toRotationMatrix());
  }
  SensorLight result(light.width, light.height);
  parallel_for(0, light.height, [&](int y) {
    for (int x = 0; x < light.width; ++x) {
      const Vector3d ray = unproject(lens, {x + 0.5, y + 0.5});
      Vector3f sum = Vector3f::Zero();
      for (const Eigen::Matrix3d& turn : turns)
        sum += between_pixels(light, project(lens, turn * ray));
      result.radiance[static_cast<std::size_t>(y) * light.width + x] =
          sum / static_cast<float>(steps);
    }
  });
  return result;
}

bool behind_stop(const ScopeSensor& sensor, int width, int height, int x, int y) {
  const double dx = x + 0.5 - 0.5 * width, dy = y + 0.5 - 0.5 * height;
  return sensor.stop_radius_px > 0 &&
         dx * dx + dy * dy > sensor.stop_radius_px * sensor.stop_radius_px;
}

std::pair<int, int> columns_in_stop(const ScopeSensor& sensor, double beyond_px, int width,
                                    int height, int y) {
  if (sensor.stop_radius_px <= 0) return {0, width};
  const double radius = sensor.stop_radius_px + beyond_px, dy = y + 0.5 - 0.5 * height;
  if (std::abs(dy) >= radius) return {0, 0};
  const double half = std::sqrt(radius * radius - dy * dy);
  return {std::max(0, static_cast<int>(0.5 * width - half)),
          std::min(width, static_cast<int>(0.5 * width + half) + 1)};
}

Rgb8Image exposed(const SensorLight& light, const ScopeSensor& sensor) {
  Rgb8Image image(light.width, light.height);
  const double radius2 = std::pow(0.5 * std::max(light.width, light.height), 2);
  parallel_for(0, light.height, [&](int y) {
    RandomStream random(sensor.seed + sensor.stream, static_cast<std::uint64_t>(y));
    for (int x = 0; x < light.width; ++x) {
      if (behind_stop(sensor, light.width, light.height, x, y)) continue;
      const double r2 =
          std::pow(x + 0.5 - 0.5 * light.width, 2) + std::pow(y + 0.5 - 0.5 * light.height, 2);
      const double left = 1 - kVignette * std::min(1.0, r2 / radius2);
      const Vector3f& radiance = light.radiance[static_cast<std::size_t>(y) * light.width + x];
      for (int c = 0; c < 3; ++c) {
        const double value = encoded(left * radiance[c]) + sensor.noise * random.normal();
        image.at(x, y)[c] =
            static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
      }
    }
  });
  return image;
}

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
