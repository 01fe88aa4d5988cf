// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/shading_surfaces.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {
namespace {

constexpr double kStep = 1e-5;  // of numerical slopes; the surfaces are of size 1

double peaks(double x, double y) {
  return 3 * (1 - x) * (1 - x) * std::exp(-x * x - (y + 1) * (y + 1)) -
         10 * (x / 5 - x * x * x - std::pow(y, 5)) * std::exp(-x * x - y * y) -
         std::exp(-(x + 1) * (x + 1) - y * y) / 3;
}

double root(double square) { return square > 0 ? std::sqrt(square) : 0; }

// Heights in image widths; x in −½…½, y in 0…1.
double height_of(const std::string& name, double x, double y) {
  const double v = y - 0.5, r2 = x * x + v * v;
  if (name == "vase") {
    const double f = 0.15 - 0.1 * y * std::pow(6 * y + 1, 2) * std::pow(y - 1, 2) * (3 * y - 2);
    return root(f * f - x * x);
  }
  if (name == "sphere") return root(0.16 - r2);
  if (name == "gauss") return 0.25 * std::exp(-r2 / 0.045);
  if (name == "sombrero") {
    const double r = 20 * std::sqrt(r2);
    return 40.0 / 128 * (r < 1e-9 ? 1 : std::sin(r) / r);
  }
  if (name == "peaks") return 0.03 * peaks(6 * x, 6 * v);
  throw UsageError("there is no surface '" + name + "'");
}

}  // namespace

const std::vector<std::string>& distant_scene_names() {
  static const std::vector<std::string> names = {"vase", "sphere", "gauss", "sombrero", "peaks"};
  return names;
}

DistantScene distant_scene(const std::string& name, int size, const DistantLight& light) {
  DistantScene scene{Plane(size, size), Plane(size, size)};
  const Eigen::Vector3d toward = light.toward();
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      const double x = (column + 0.5) / size - 0.5, y = (row + 0.5) / size;
      const double p =
          -(height_of(name, x + kStep, y) - height_of(name, x - kStep, y)) / (2 * kStep);
      const double q =
          -(height_of(name, x, y + kStep) - height_of(name, x, y - kStep)) / (2 * kStep);
      scene.intensity.at(column, row) = static_cast<float>(std::max(0.0, lambert(p, q, toward)));
      scene.depth.at(column, row) = static_cast<float>(-size * height_of(name, x, y));
    }
  return scene;
}

NearScene near_scene(double amplitude, int size) {
  NearScene scene{Plane(size, size), Plane(size, size), {}};
  scene.camera.width = scene.camera.height = size;
  scene.camera.fx = scene.camera.fy = size;
  scene.camera.cx = scene.camera.cy = 0.5 * size;
  const RayGrid rays = ray_grid(scene.camera);
  const auto log_range = [&](double x, double y) {
    return std::log(60.0) + 0.06 * amplitude * peaks(5.2 * x, 5.2 * y);
  };
  std::vector<double> light(scene.intensity.size());
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      const double x = rays.x(column), y = rays.y(row);
      const double p = (log_range(x + kStep, y) - log_range(x - kStep, y)) / (2 * kStep);
      const double q = (log_range(x, y + kStep) - log_range(x, y - kStep)) / (2 * kStep);
      const double along = x * p + y * q;
      const double g = (1 + x * x + y * y) * (p * p + q * q + along * along);
      const double v = log_range(x, y);
      const std::size_t k = scene.intensity.index(column, row);
      scene.log_range.values[k] = static_cast<float>(v);
      light[k] = std::exp(-2 * v) / std::sqrt(1 + g);
    }
  const double brightest = *std::max_element(light.begin(), light.end());
  for (std::size_t k = 0; k < light.size(); ++k)
    scene.intensity.values[k] = static_cast<float>(light[k] / brightest);
  return scene;
}

void add_noise(Plane& intensity, double share, bool eight_bit, std::uint64_t seed) {
  for (std::size_t k = 0; k < intensity.size(); ++k) {
    RandomStream random(seed, k);
    double value = intensity.values[k] + share * random.normal();
    if (eight_bit) value = std::round(255 * std::clamp(value, 0.0, 1.0)) / 255;
    intensity.values[k] = static_cast<float>(value);
  }
}

}  // namespace organbake
