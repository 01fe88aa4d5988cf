// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/undistort.h"

#include <cmath>

#include "organbake/core/text.h"
#include "organbake/geometry/camera.h"

namespace organbake {
namespace {

// Where the pinhole's pixel lies among the centres of the lens's pixels.
Eigen::Vector2d source_of(int x, int y, const Intrinsics& lens, const Intrinsics& pinhole) {
  const Eigen::Vector3d ray((x + 0.5 - pinhole.cx) / pinhole.fx,
                            (y + 0.5 - pinhole.cy) / pinhole.fy, 1);
  return project(lens, ray) - Eigen::Vector2d(0.5, 0.5);
}

// The four pixels round a place, and how far between them it lies.
struct CellPosition {
  int x, y;
  double u, v;

  double of(double a, double b, double c, double d) const {
    return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
  }
};

// Calls put(x, y, between) for each of the pinhole's pixels whose source lies inside.
template <class Put>
void from_inside(const Intrinsics& lens, const Intrinsics& pinhole, const Put& put) {
  for (int y = 0; y < pinhole.height; ++y)
    for (int x = 0; x < pinhole.width; ++x) {
      const Eigen::Vector2d at = source_of(x, y, lens, pinhole);
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < lens.width - 1 && at.y() < lens.height - 1))
        continue;
      const int x0 = static_cast<int>(at.x()), y0 = static_cast<int>(at.y());
      put(x, y, CellPosition{x0, y0, at.x() - x0, at.y() - y0});
    }
}

}  // namespace

Rgb8Image undistorted(const Rgb8Image& picture, const Intrinsics& lens, const Intrinsics& pinhole) {
  Rgb8Image straight(pinhole.width, pinhole.height);
  from_inside(lens, pinhole, [&](int x, int y, const CellPosition& b) {
    for (int c = 0; c < 3; ++c)
      straight.at(x, y)[c] = static_cast<std::uint8_t>(
          b.of(picture.at(b.x, b.y)[c], picture.at(b.x + 1, b.y)[c], picture.at(b.x, b.y + 1)[c],
               picture.at(b.x + 1, b.y + 1)[c]) +
          0.5);
  });
  return straight;
}

Plane undistorted(const Plane& plane, const Intrinsics& lens, const Intrinsics& pinhole) {
  Plane straight(pinhole.width, pinhole.height);
  from_inside(lens, pinhole, [&](int x, int y, const CellPosition& b) {
    straight.at(x, y) = static_cast<float>(
        b.of(double(plane.at(b.x, b.y)), double(plane.at(b.x + 1, b.y)),
             double(plane.at(b.x, b.y + 1)), double(plane.at(b.x + 1, b.y + 1))));
  });
  return straight;
}

Mask undistorted(const Mask& mask, const Intrinsics& lens, const Intrinsics& pinhole) {
  Mask straight(pinhole.width, pinhole.height);
  from_inside(lens, pinhole, [&](int x, int y, const CellPosition& b) {
    straight.at(x, y) = mask.at(b.x + (b.u < 0.5 ? 0 : 1), b.y + (b.v < 0.5 ? 0 : 1));
  });
  return straight;
}

std::string told_of_fisheye(const Intrinsics& lens) {
  if (lens.model != LensModel::fisheye) return "";
  constexpr double kDegrees = 57.29577951308232;
  const auto degrees = [](double angle_rad) { return to_text(kDegrees * angle_rad, 0); };
  const double left = angle_across_rad(pinhole_of(lens));
  return "the lens is a fisheye of " + degrees(angle_across_rad(lens)) +
         " degrees across; its middle " + degrees(left) +
         " degrees are straightened to a pinhole's picture, and what lies beyond is left out";
}

}  // namespace organbake
