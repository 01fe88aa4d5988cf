// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "geometry/camera.h"
#include "image/channel_image.h"

namespace organbake {

// What reaches the sensor of a scope, linear; 1 is white.
struct ScopeLight {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> radiance;  // row-major

  ScopeLight(int w, int h)
      : width(w), height(h), radiance(static_cast<std::size_t>(w) * h, Eigen::Vector3f::Zero()) {}
};

// The mean of what the pixels see while the scope turns about its lens by `turn_rad` (about its x
// and y axes), from half of it before to half of it after. What lies beyond the picture is taken
// from its border.
ScopeLight blurred_by_turn(const ScopeLight& light, const Intrinsics& lens,
                           const Eigen::Vector2d& turn_rad);

// A round stop leaves the picture's corners black.
struct ScopeSensor {
  double noise = 0.005;       // standard deviation, as a share of full scale
  double stop_radius_px = 0;  // 0 = none
  std::uint64_t seed = 1, stream = 0;
};
bool behind_stop(const ScopeSensor& sensor, int width, int height, int x, int y);
Rgb8Image exposed(const ScopeLight& light, const ScopeSensor& sensor);

}  // namespace organbake
