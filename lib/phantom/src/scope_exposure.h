// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// What reaches the sensor of a scope, linear; 1 is white.
struct SensorLight {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> radiance;  // row-major

  SensorLight(int w, int h)
      : width(w), height(h), radiance(static_cast<std::size_t>(w) * h, Eigen::Vector3f::Zero()) {}
};

// The mean of what the pixels see while the scope turns about its lens by `turn_rad` (about its x
// and y axes), from half of it before to half of it after. What lies beyond the picture is taken
// from its border.
SensorLight blurred_by_turn(const SensorLight& light, const Intrinsics& lens,
                            const Eigen::Vector2d& turn_rad);

// A round stop leaves the picture's corners black.
struct ScopeSensor {
  double noise = 0.005;       // standard deviation, as a share of full scale
  double stop_radius_px = 0;  // 0 = none
  std::uint64_t seed = 1, stream = 0;
};
bool behind_stop(const ScopeSensor& sensor, int width, int height, int x, int y);
// The row's columns, first and behind the last, that lie within the stop and `beyond_px` round it.
std::pair<int, int> columns_in_stop(const ScopeSensor& sensor, double beyond_px, int width,
                                    int height, int y);
Rgb8Image exposed(const SensorLight& light, const ScopeSensor& sensor);

}  // namespace organbake
