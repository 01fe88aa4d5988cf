// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fisheye.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

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
  for (const auto& [name, focal] : {std::pair{"fx", fx}, std::pair{"fy", fy}}) {
    require(focal >= kLeastFocal && focal <= kMostFocal, name, focal, "needs 0.001…1e9 pixels");
  }
  require(std::isfinite(cx), "cx", cx, "needs a finite number of pixels");
  require(std::isfinite(cy), "cy", cy, "needs a finite number of pixels");
  for (const double d : {k1, k2, p1, p2, k3, k4}) {
    require(std::isfinite(d), "distortion", d, "needs finite coefficients");
  }
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
