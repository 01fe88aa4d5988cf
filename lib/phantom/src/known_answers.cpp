// SPDX-License-Identifier: GPL-3.0-or-later
// Inputs with known answers, by their formulas. A voxel of the ball's CT is the mean over its box;
// the surfaces for shading are those of Zhang et al. 1999 and others.
#include "organbake/phantom/known_answers.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/shading/depth_maps.h"

namespace organbake {
namespace {

constexpr double kMargin_mm = 10;
constexpr double kOffCentre_voxels = 0.37;

// Share of a voxel's box inside the ball: exact along z, by midpoints across.
double share_in_ball(const Eigen::Vector3d& at, const Eigen::Vector3d& box, double radius) {
  if (at.norm() > radius + box.norm()) return 0;
  if (at.norm() < radius - box.norm()) return 1;
  constexpr int kColumns = 8;
  double inside = 0;
  for (int a = 0; a < kColumns; ++a) {
    for (int b = 0; b < kColumns; ++b) {
      const double x = at.x() + ((a + 0.5) / kColumns - 0.5) * box.x();
      const double y = at.y() + ((b + 0.5) / kColumns - 0.5) * box.y();
      const double half = std::sqrt(std::max(0.0, radius * radius - x * x - y * y));
      const double low = std::max(-half, at.z() - box.z() / 2);
      const double high = std::min(half, at.z() + box.z() / 2);
      inside += std::max(0.0, high - low) / box.z();
    }
  }
  return inside / (kColumns * kColumns);
}

Volume empty_grid(double extent_mm, const Eigen::Vector3d& spacing_mm) {
  Volume volume;
  volume.spacing_mm = spacing_mm;
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    volume.size[axis] = 2 * static_cast<int>(std::ceil(extent_mm / spacing_mm[axis] / 2)) + 1;
    middle[axis] = (volume.size[axis] - 1) / 2.0 + kOffCentre_voxels;
  }
  volume.origin_mm = -spacing_mm.cwiseProduct(middle);
  return volume;
}

}  // namespace

Volume scan_ball(double radius_mm, const Eigen::Vector3d& spacing_mm) {
  Volume ct = empty_grid(2 * (radius_mm + kMargin_mm), spacing_mm);
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const double share =
            share_in_ball(ct.world_from_index(Eigen::Vector3d(i, j, k)), spacing_mm, radius_mm);
        const double hu = kBallAir_hu + (kBallTissue_hu - kBallAir_hu) * share;
        ct.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
      }
    }
  }
  return ct;
}

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

void add_noise(Plane& intensity, double share, std::uint64_t seed) {
  for (std::size_t k = 0; k < intensity.size(); ++k) {
    RandomStream random(seed, k);
    const double value = intensity.values[k] + share * random.normal();
    intensity.values[k] = static_cast<float>(std::round(255 * std::clamp(value, 0.0, 1.0)) / 255);
  }
}

}  // namespace organbake
