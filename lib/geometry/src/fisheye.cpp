// SPDX-License-Identifier: Apache-2.0
#include "fisheye.h"

#include <cmath>

namespace organbake {
namespace {

constexpr double kWidest_rad = 1.5690;  // 89.9°: rays of z = 1 are finite

double radius_at(const Intrinsics& k, double angle) {
  const double a2 = angle * angle;
  return angle * (1 + a2 * (k.k1 + a2 * (k.k2 + a2 * (k.k3 + a2 * k.k4))));
}

double slope_at(const Intrinsics& k, double angle) {
  const double a2 = angle * angle;
  return 1 + a2 * (3 * k.k1 + a2 * (5 * k.k2 + a2 * (7 * k.k3 + a2 * 9 * k.k4)));
}

// Up to which angle a wider ray meets the picture farther out.
double widest_rising(const Intrinsics& k) {
  constexpr int kSteps = 32;
  double angle = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double next = kWidest_rad * i / kSteps;
    if (slope_at(k, next) <= 0) return angle;
    angle = next;
  }
  return angle;
}

// Newton's steps, halved intervals where they leave the bracket.
double angle_at(const Intrinsics& k, double radius) {
  double low = 0, high = widest_rising(k);
  if (!(radius_at(k, high) > radius)) return high;
  double angle = std::min(radius, high);
  constexpr int kMostSteps = 60;
  for (int i = 0; i < kMostSteps; ++i) {
    const double off = radius_at(k, angle) - radius;
    (off > 0 ? high : low) = angle;
    double next = angle - off / slope_at(k, angle);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == angle || off == 0) break;
    angle = next;
  }
  return angle;
}

}  // namespace

Eigen::Vector2d fisheye_place(const Intrinsics& lens, const Eigen::Vector3d& point_camera_mm) {
  const double across = point_camera_mm.head<2>().norm();
  if (across == 0) return Eigen::Vector2d::Zero();
  const double radius = radius_at(lens, std::atan2(across, point_camera_mm.z()));
  return radius / across * point_camera_mm.head<2>();
}

Eigen::Vector3d fisheye_ray(const Intrinsics& lens, const Eigen::Vector2d& place) {
  const double radius = place.norm();
  if (radius == 0) return Eigen::Vector3d::UnitZ();
  const double across = std::tan(angle_at(lens, radius));
  return {across / radius * place.x(), across / radius * place.y(), 1.0};
}

}  // namespace organbake
