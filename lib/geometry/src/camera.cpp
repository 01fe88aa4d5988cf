// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/camera.h"

#include <cmath>

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

}  // namespace organbake
