// SPDX-License-Identifier: GPL-3.0-or-later
// Depth is faulty as matching leaves it: noise from pixel to pixel, errors that are smooth over the
// tissue, a scale that is a little wrong, and tissue in front.
#include "support/faulty_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/core/quantile.h"
#include "organbake/core/random.h"

namespace organbake {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// A sum of waves of about one length in all directions; mean 0, standard deviation 1.
class SmoothField {
 public:
  SmoothField(double wavelength, RandomStream& random) {
    for (Wave& wave : waves_) {
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      wave.slope = 2 * std::numbers::pi / wavelength * random.uniform(0.6, 1.6) *
                   Vector2d(std::cos(angle), std::sin(angle));
      wave.phase = random.uniform(0, 2 * std::numbers::pi);
    }
  }
  double at(const Vector2d& x) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::cos(wave.slope.dot(x) + wave.phase);
    return sum * std::sqrt(2.0 / kWaves);
  }

 private:
  static constexpr int kWaves = 12;
  struct Wave {
    Vector2d slope;
    double phase = 0;
  };
  std::array<Wave, kWaves> waves_;
};

std::vector<Vector3d> rays_of(const Intrinsics& lens) {
  std::vector<Vector3d> rays;
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) rays.push_back(unproject(lens, {x + 0.5, y + 0.5}));
  return rays;
}

// The height of the field above which so much of the view lies.
double level_of_share(const SmoothField& field, const std::vector<Vector3d>& rays, double share) {
  if (!(share > 0)) return std::numeric_limits<double>::infinity();
  std::vector<double> heights;
  for (const Vector3d& ray : rays) heights.push_back(field.at(ray.head<2>()));
  return quantile(std::move(heights), 1 - std::min(1.0, share));
}

}  // namespace

std::vector<Vector3d> faulty_depth(const RayScene& organ, const PosedCamera& camera, double wall_mm,
                                   const DepthFaults& faults, std::uint64_t seed) {
  constexpr double kBump_mm = 20, kFat = 0.7, kSlant = 0.5, kThin_mm = 2, kThick_mm = 10;
  RandomStream random(seed, 1601);
  const SmoothField bumps(kBump_mm / wall_mm, random), fat(kFat, random);
  const double bias = faults.bias * (random.uniform() < 0.5 ? -1 : 1) * random.uniform(0.5, 1);
  const std::vector<Vector3d> rays = rays_of(camera.intrinsics);
  const double fat_level = level_of_share(fat, rays, faults.hidden_share);
  const RigidTransform world_from_camera = camera.camera_from_world.inverse();
  std::vector<Vector3d> points;
  for (const Vector3d& ray : rays) {
    const Ray way{world_from_camera.translation, world_from_camera.rotation * ray};
    RayHit seen;
    organ.first_hits({&way, 1}, {&seen, 1});
    const Vector2d view = ray.head<2>();
    double z = seen.face == kNoHit ? wall_mm * (1 + kSlant * view.x()) : seen.t;
    const double over = fat.at(view) - fat_level;
    if (over > 0) z -= kThin_mm + kThick_mm * std::min(1.0, over);
    z *= 1 + bias + faults.noise * random.normal();
    z += faults.bumps_mm * bumps.at(view);
    points.push_back(z / faults.mm_per_unit * ray);
  }
  return points;
}

}  // namespace organbake
