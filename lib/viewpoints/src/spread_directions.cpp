// SPDX-License-Identifier: GPL-3.0-or-later
// Evenly spread directions: a Fibonacci spiral relaxed by repulsion (Thomson's problem), by
// steepest descent. The result is turned in one way always, so that equal counts give equal
// cameras.
#include "placing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace organbake {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kAllRound = kPi - 1e-9;
using DirectionList = std::vector<Eigen::Vector3d>;

// All in the frame whose +z is the axis.
Eigen::Vector3d at_angles(double from_axis, double azimuth) {
  return {std::sin(from_axis) * std::cos(azimuth), std::sin(from_axis) * std::sin(azimuth),
          std::cos(from_axis)};
}

// At heights that go linearly, for equal areas of the cap lie between them.
Eigen::Vector3d on_spiral(double height, double azimuth) {
  return at_angles(std::acos(std::clamp(height, -1.0, 1.0)), azimuth);
}

const double kGoldenAngle = kPi * (3 - std::sqrt(5.0));

DirectionList spiral(int count, double half_angle) {
  DirectionList directions;
  for (int i = 0; i < count; ++i) {
    const double height = 1 - (1 - std::cos(half_angle)) * i / std::max(count - 1, 1);
    directions.push_back(on_spiral(height, kGoldenAngle * i));
  }
  return directions;
}

DirectionList spiral_off_the_rim(int count, double half_angle) {
  constexpr double kTurn = 1.0;  // any that is no multiple of the golden angle
  DirectionList directions;
  for (int i = 0; i < count; ++i) {
    const double height = 1 - (1 - std::cos(half_angle)) * (i + 0.5) / count;
    directions.push_back(on_spiral(height, kTurn + kGoldenAngle * i));
  }
  return directions;
}

DirectionList on_the_rim(int count, double half_angle) {
  DirectionList directions;
  for (int i = 0; i < count; ++i) {
    directions.push_back(at_angles(half_angle, 2 * kPi * i / count));
  }
  return directions;
}

double energy(const DirectionList& directions) {
  double sum = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      sum += 1 / std::max((directions[i] - directions[j]).squaredNorm(), 1e-30);
    }
  }
  return sum;
}

DirectionList forces(const DirectionList& directions) {
  DirectionList result(directions.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Vector3d apart = directions[i] - directions[j];
      const double distance2 = std::max(apart.squaredNorm(), 1e-30);
      result[i] += apart / (distance2 * distance2);
      result[j] -= apart / (distance2 * distance2);
    }
  }
  for (std::size_t i = 0; i < directions.size(); ++i) {  // along the sphere only
    result[i] -= directions[i] * directions[i].dot(result[i]);
  }
  return result;
}

Eigen::Vector3d inside_cap(const Eigen::Vector3d& direction, double half_angle) {
  const Eigen::Vector3d unit = direction.normalized();
  if (half_angle >= kAllRound || unit.z() >= std::cos(half_angle)) return unit;
  return at_angles(half_angle, std::atan2(unit.y(), unit.x()));
}

// Steepest descent with a step that grows while the energy falls. The first stays on the axis.
void relax(DirectionList& directions, double half_angle) {
  constexpr int kMostSteps = 4000;
  constexpr double kAtRest = 1e-13;  // largest move, radians
  double current = energy(directions);
  // A share of what would carry a camera over its own patch: forces go with 1/spacing³.
  const double patch =
      2 * kPi * (1 - std::cos(half_angle)) / static_cast<double>(directions.size());
  double step = 0.01 * patch * patch;
  for (int i = 0; i < kMostSteps; ++i) {
    const DirectionList force = forces(directions);
    DirectionList moved = directions;
    double largest_move = 0;
    for (std::size_t k = 1; k < directions.size(); ++k) {
      moved[k] = inside_cap(directions[k] + step * force[k], half_angle);
      largest_move = std::max(largest_move, (moved[k] - directions[k]).norm());
    }
    const double next = energy(moved);
    if (next <= current) {
      directions = std::move(moved);
      current = next;
      step *= 1.2;
    } else {
      step *= 0.5;
    }
    if (largest_move < kAtRest) break;
  }
}

// Turns about +z until the first direction's nearest neighbour (or itself, off the axis) has
// azimuth 0.
void roll(DirectionList& directions) {
  if (directions.size() < 2) return;
  std::size_t nearest = 1;
  for (std::size_t k = 2; k < directions.size(); ++k) {
    // Symmetric sets have several; the first of them, whatever rounding says.
    constexpr double kClearlyNearer = 1e-6;
    if (directions[0].dot(directions[k]) >
        directions[0].dot(directions[nearest]) + kClearlyNearer) {
      nearest = k;
    }
  }
  const Eigen::Vector3d& d = directions[nearest];
  const double azimuth = std::hypot(d.x(), d.y()) > 1e-9 ? std::atan2(d.y(), d.x()) : 0.0;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(-azimuth, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (Eigen::Vector3d& direction : directions) direction = turn * direction;
}

// Columns: level to the right of a viewer who stands on the axis, up, axis.
Eigen::Matrix3d world_from_cap(const Eigen::Vector3d& axis) {
  const Eigen::Vector3d z = axis.normalized();
  constexpr double kNearlyVertical = 0.999;
  const Eigen::Vector3d up =
      std::abs(z.z()) < kNearlyVertical ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
  Eigen::Matrix3d frame;
  frame.col(0) = up.cross(z).normalized();
  frame.col(1) = z.cross(frame.col(0));
  frame.col(2) = z;
  return frame;
}

}  // namespace

std::vector<Eigen::Vector3d> spread_directions(int count, const Eigen::Vector3d& axis,
                                               double half_angle_rad) {
  DirectionList directions;
  if (count > 1 && count < 4 && half_angle_rad < kPi / 2) {
    directions = on_the_rim(count, half_angle_rad);
  } else {
    directions = spiral(count, half_angle_rad);
    relax(directions, half_angle_rad);
    roll(directions);
  }
  const Eigen::Matrix3d frame = world_from_cap(axis);
  // Where the search stopped is about 1e-8 off; a pole is a pole, or its camera's roll is chance.
  constexpr double kStopped = 1e-7;
  for (Eigen::Vector3d& direction : directions) {
    direction = frame * direction;
    direction = (direction.array().abs() < kStopped).select(0.0, direction.array()).matrix();
    direction.normalize();
  }
  return directions;
}

double even_spacing_rad(std::size_t count, double half_angle_rad) {
  return std::sqrt(2 * kPi * (1 - std::cos(half_angle_rad)) / static_cast<double>(count));
}

std::vector<Eigen::Vector3d> lattice_directions(int count, const Eigen::Vector3d& axis,
                                                double half_angle_rad, LatticeKind lattice) {
  DirectionList directions = lattice == LatticeKind::on_rim
                                 ? spiral(count, half_angle_rad)
                                 : spiral_off_the_rim(count, half_angle_rad);
  if (lattice == LatticeKind::on_rim && half_angle_rad < kAllRound) {
    const double spacing = even_spacing_rad(static_cast<std::size_t>(count), half_angle_rad);
    const int ring = static_cast<int>(std::ceil(2 * kPi * std::sin(half_angle_rad) / spacing));
    // The spiral itself ends on the rim, at some azimuth: the ring begins half a step beside it.
    const double last = std::atan2(directions.back().y(), directions.back().x());
    for (int i = 0; i < ring; ++i) {
      directions.push_back(at_angles(half_angle_rad, last + 2 * kPi * (i + 0.5) / ring));
    }
  }
  const Eigen::Matrix3d frame = world_from_cap(axis);
  for (Eigen::Vector3d& direction : directions) direction = (frame * direction).normalized();
  return directions;
}

}  // namespace organbake
