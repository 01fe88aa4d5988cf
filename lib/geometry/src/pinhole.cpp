// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/pinhole.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {
namespace {

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
