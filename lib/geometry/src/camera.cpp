// SPDX-License-Identifier: Apache-2.0
// Rigid transforms and lenses: projection by Brown's model or, for fisheyes, by the angle to the
// axis (Kannala & Brandt 2006), and both backwards by iteration.
#include "organbake/geometry/camera.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
bool is_rotation(const Eigen::Matrix3d& r, double tolerance) {
  const double off = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return off <= tolerance && r.row(0).cross(r.row(1)).dot(r.row(2)) > 0;
}

Eigen::Vector3d up_from(const Eigen::Vector3d& direction_world) {
  constexpr double kAlong = 0.8660254037844386;  // cosine of 30°
  const bool along = std::abs(direction_world.z()) > kAlong * direction_world.norm();
  return along ? Eigen::Vector3d(-Eigen::Vector3d::UnitY()) : Eigen::Vector3d::UnitZ();
}

RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                       const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  Eigen::Vector3d right = forward.cross(up);
  constexpr double kParallel = 1e-9;  // sine of the angle below which `up` tells nothing
  if (!(right.norm() > kParallel * up.norm())) {
    Eigen::Index least = 0;
    forward.cwiseAbs().minCoeff(&least);
    right = forward.cross(Eigen::Vector3d::Unit(least));
  }
  right.normalize();
  RigidTransform camera_from_world;
  camera_from_world.rotation.row(0) = right.transpose();
  camera_from_world.rotation.row(1) = forward.cross(right).transpose();
  camera_from_world.rotation.row(2) = forward.transpose();
  camera_from_world.translation = -(camera_from_world.rotation * eye);
  return camera_from_world;
}

std::optional<Eigen::Matrix3d> written_rotation(const Eigen::Matrix3d& r) {
  constexpr double kRounding = 1e-12, kWritten = 1e-4;
  if (!is_rotation(r, kWritten)) return std::nullopt;
  if (is_rotation(r, kRounding)) return r;
  // The nearest one, by Newton's steps (Higham 1986), which square what is left of 1e-4.
  Eigen::Matrix3d nearest = r;
  for (int step = 0; step < 4; ++step)
    nearest = nearest * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * nearest.transpose() * nearest);
  return nearest;
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

namespace {

// Kannala & Brandt 2006, as OpenCV's fisheye, ROS ("equidistant"), Kalibr and COLMAP write it: a
// ray at the angle θ to the axis meets the picture at θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) focal
// lengths from its centre.

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

// Place in focal lengths from the principal point of a camera-space point, which may lie beside the
// camera, too.
Eigen::Vector2d fisheye_place(const Intrinsics& lens, const Eigen::Vector3d& point_camera_mm) {
  const double across = point_camera_mm.head<2>().norm();
  if (across == 0) return Eigen::Vector2d::Zero();
  const double radius = radius_at(lens, std::atan2(across, point_camera_mm.z()));
  return radius / across * point_camera_mm.head<2>();
}

// Camera-space ray of z = 1 that meets this place. Beyond 89.9° from the axis, and where the
// polynomial has ceased to rise, the widest ray that is known in that direction.
Eigen::Vector3d fisheye_ray(const Intrinsics& lens, const Eigen::Vector2d& place) {
  const double radius = place.norm();
  if (radius == 0) return Eigen::Vector3d::UnitZ();
  const double across = std::tan(angle_at(lens, radius));
  return {across / radius * place.x(), across / radius * place.y(), 1.0};
}

constexpr int kLargestSide = 65536;
constexpr double kLeastFocal = 1e-3, kMostFocal = 1e9;  // beyond, no view is meant

// Brown's model (OpenCV's order k1 k2 p1 p2 k3) on normalised coordinates.
Eigen::Vector2d distort(const Intrinsics& k, const Eigen::Vector2d& n) {
  const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
  const double radial = 1 + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
  return {x * radial + 2 * k.p1 * x * y + k.p2 * (r2 + 2 * x * x),
          y * radial + k.p1 * (r2 + 2 * y * y) + 2 * k.p2 * x * y};
}

void require(bool ok, const char* field, double value, const char* rule) {
  if (ok) return;
  throw BadDataError(std::string("camera intrinsics: ") + field + " = " + to_text(value) + ", " +
                     rule);
}

// How often the picture was halved, each time losing an odd row or column; 0 = it was not.
int halvings_to(const Intrinsics& lens, int width, int height) {
  constexpr int kMost = 6;
  for (int n = 1; n <= kMost; ++n)
    if (lens.width >> n == width && lens.height >> n == height) return n;
  return 0;
}

double angle_off_axis(const Intrinsics& lens, double x, double y) {
  const Eigen::Vector3d ray = unproject(lens, {x, y});
  return std::atan(ray.head<2>().norm());
}

}  // namespace

void Intrinsics::check() const {
  require(width >= 1 && width <= kLargestSide, "width", width, "needs 1…65536 pixels");
  require(height >= 1 && height <= kLargestSide, "height", height, "needs 1…65536 pixels");
  for (const auto& [name, focal] : {std::pair{"fx", fx}, std::pair{"fy", fy}})
    require(focal >= kLeastFocal && focal <= kMostFocal, name, focal, "needs 0.001…1e9 pixels");
  require(std::isfinite(cx), "cx", cx, "needs a finite number of pixels");
  require(std::isfinite(cy), "cy", cy, "needs a finite number of pixels");
  for (const double d : {k1, k2, p1, p2, k3, k4})
    require(std::isfinite(d), "distortion", d, "needs finite coefficients");
}

Eigen::Vector2d project(const Intrinsics& k, const Eigen::Vector3d& point_camera_mm) {
  Eigen::Vector2d n;
  if (k.model == LensModel::fisheye) {
    n = fisheye_place(k, point_camera_mm);
  } else {
    n = point_camera_mm.head<2>() / point_camera_mm.z();
    if (k.has_distortion()) n = distort(k, n);
  }
  return {k.fx * n.x() + k.cx, k.fy * n.y() + k.cy};
}

Eigen::Vector3d unproject(const Intrinsics& k, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d seen((pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy);
  if (k.model == LensModel::fisheye) return fisheye_ray(k, seen);
  Eigen::Vector2d n = seen;
  if (k.has_distortion()) {
    constexpr int kMostIterations = 100;  // strong fisheye-like lenses converge slowly
    constexpr double kConverged = 1e-12;
    for (int i = 0; i < kMostIterations; ++i) {
      const Eigen::Vector2d step = seen - distort(k, n);
      n += step;
      if (step.squaredNorm() < kConverged * kConverged) break;
    }
  }
  return {n.x(), n.y(), 1.0};
}

double angle_across_rad(const Intrinsics& lens) {
  return angle_off_axis(lens, 0, lens.cy) + angle_off_axis(lens, lens.width, lens.cy);
}

Intrinsics pinhole_of(const Intrinsics& lens) {
  Intrinsics pinhole = lens;
  pinhole.model = LensModel::brown;
  pinhole.k1 = pinhole.k2 = pinhole.p1 = pinhole.p2 = pinhole.k3 = pinhole.k4 = 0;
  if (lens.model != LensModel::fisheye) return pinhole;
  const double sides[4][3] = {{0, lens.cy, lens.cx},
                              {double(lens.width), lens.cy, lens.width - lens.cx},
                              {lens.cx, 0, lens.cy},
                              {lens.cx, double(lens.height), lens.height - lens.cy}};
  double focal = std::numeric_limits<double>::infinity(), widest_px = 0;
  for (const auto& [x, y, reach_px] : sides) {
    if (!(reach_px > 0)) continue;  // the axis lies beside the picture
    const double angle = std::min(angle_off_axis(lens, x, y), 0.5 * kWidestPinhole_rad);
    focal = std::min(focal, reach_px / std::tan(angle));
    widest_px = std::max(widest_px, reach_px);
  }
  // Nor may what one side wants take the other one farther.
  pinhole.fx = pinhole.fy = std::max(focal, widest_px / std::tan(0.5 * kWidestPinhole_rad));
  return pinhole;
}

Intrinsics scaled_lens(const Intrinsics& lens, int width, int height) {
  const int halvings = halvings_to(lens, width, height);
  const double halved = std::ldexp(1.0, -halvings);
  const double x = halvings > 0 ? halved : double(width) / lens.width;
  const double y = halvings > 0 ? halved : double(height) / lens.height;
  Intrinsics scaled = lens;
  scaled.width = width;
  scaled.height = height;
  scaled.fx *= x;
  scaled.cx *= x;
  scaled.fy *= y;
  scaled.cy *= y;
  return scaled;
}

bool is_scaled_picture(const Intrinsics& lens, int width, int height) {
  if (halvings_to(lens, width, height) > 0) return true;
  const double off = std::abs(double(width) * lens.height - double(height) * lens.width);
  return off <= std::max(lens.width, lens.height);  // a pixel of the longer side
}

}  // namespace organbake
