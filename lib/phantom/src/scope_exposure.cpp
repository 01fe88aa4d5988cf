// SPDX-License-Identifier: GPL-3.0-or-later
#include "scope_exposure.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"

namespace organbake {
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

}  // namespace organbake
