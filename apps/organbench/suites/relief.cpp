// SPDX-License-Identifier: GPL-3.0-or-later
// How much of a shaded relief is kept, and whether the verdict knows what it is worth, on rendered
// tubes, sacs, plates and organs.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "bench.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/core/smooth_step.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// What a scope sees from within a tube or a sac, of a plate across its view, and of an organ before
// a wall: bumps, folds, a beam and a vignette, texture, often a second tissue, highlights, some
// light from the walls, and noise. Distances are marched to along each ray.
class ScopeScene {
 public:
  enum Kind { tube, sac, plate, organ };
  static constexpr int kKinds = 4;

  ScopeScene(Kind kind, std::uint64_t seed, int width)
      : kind_(kind), random_(seed, 555 + kind), size_mm_(random_.uniform(8, 30)) {
    camera_ = assumed_camera(width, width * 3 / 4, random_.uniform(0.9, 1.9));
    for (Wave& wave : bumps_) wave = wave_of(0.3, 2);
    for (Wave& wave : texture_) wave = wave_of(0.15, 1.2);
    for (Wave& wave : patches_) wave = wave_of(0.8, 3);
    const double s = size_mm_;
    middle_ = {random_.uniform(-0.4, 0.4) * s, random_.uniform(-0.4, 0.4) * s, 0};
    radii_ = s * Vector3d(random_.uniform(1, 2), random_.uniform(1, 2), random_.uniform(1.2, 3));
    tilt_ = {random_.uniform(-0.6, 0.6), random_.uniform(-0.4, 0.4)};
    bend_ = {random_.uniform(-0.9, 0.9) * s, random_.uniform(-0.9, 0.9) * s};
    fold_ = random_.uniform(0, 0.3);
    bump_ = random_.uniform(0.01, 0.07) * s;
    if (kind == sac) middle_.z() = radii_.z() * random_.uniform(0.2, 0.85);
    if (kind == organ) middle_.z() = 3 * s;
    expose();
  }

  const Rgb8Image& picture() const { return picture_; }
  const Plane& depth() const { return depth_; }
  const Intrinsics& camera() const { return camera_; }

 private:
  struct Wave {
    Vector3d k;
    double phase;
  };
  using Waves = std::array<Wave, 12>;

  // Of a length between these shares of the scene's size.
  Wave wave_of(double shortest, double longest) {
    const Vector3d way(random_.normal(), random_.normal(), random_.normal());
    const double length = size_mm_ * shortest * std::pow(longest / shortest, random_.uniform());
    return {2 * std::numbers::pi / length * way.normalized(), random_.uniform(0, 6.28)};
  }
  static double sum(const Waves& waves, const Vector3d& p) {
    double sum = 0;
    for (const Wave& wave : waves) sum += std::sin(wave.k.dot(p) + wave.phase);
    return sum * std::sqrt(2.0 / waves.size());
  }

  // Above 0 in the open, about the distance to the nearest wall.
  double open_mm(const Vector3d& p) const {
    const double rough = bump_ * sum(bumps_, p), s = size_mm_;
    const auto ball = [&](const Vector3d& radii) {
      return ((p - middle_).cwiseQuotient(radii).norm() - 1) * radii.minCoeff();
    };
    switch (kind_) {
      case tube: {
        const Vector2d axis =
            middle_.head<2>() + tilt_ * p.z() + bend_ * (1 - std::cos(p.z() / (6 * s)));
        return s * (1 - fold_ * std::pow(0.5 + 0.5 * std::sin(6 * p.z() / s), 4)) + rough -
               (p.head<2>() - axis).norm();
      }
      case sac:
        return rough - ball(radii_);
      case plate:
        return 3 * s + tilt_.dot(p.head<2>()) + 3 * rough - p.z();
      default:
        return std::min(ball(0.8 * radii_) + rough, 4 * s + 0.5 * tilt_.x() * p.y() - p.z());
    }
  }
  Vector3d normal_at(const Vector3d& p) const {
    constexpr double kStep_mm = 0.05;
    Vector3d slope;
    for (int i = 0; i < 3; ++i)
      slope[i] =
          open_mm(p + kStep_mm * Vector3d::Unit(i)) - open_mm(p - kStep_mm * Vector3d::Unit(i));
    return slope.normalized();
  }
  // Along the unit ray; nothing within 600 mm: infinite.
  double hit_mm(const Vector3d& ray) const {
    constexpr double kFarthest_mm = 600, kLeastStep_mm = 0.15, kSafe = 0.6;
    double near = 1, far = 1;
    for (double open = 1; (open = open_mm(far * ray)) > 0;
         far += std::max(kLeastStep_mm, kSafe * open)) {
      if (far > kFarthest_mm) return INFINITY;
      near = far;
    }
    for (int i = 0; i < 14; ++i) {
      const double middle = 0.5 * (near + far);
      (open_mm(middle * ray) > 0 ? near : far) = middle;
    }
    return far;
  }

  void expose() {
    const double beam = random_.uniform() < 0.3 ? 0 : random_.uniform(0, 5);
    const double vignette = random_.uniform(0, 0.5), texture = random_.uniform(0.03, 0.35);
    const double noise = random_.uniform(0.003, 0.02), shine = random_.uniform(0, 0.6);
    const double other = random_.uniform() < 0.5 ? random_.uniform(0.45, 1.8) : 1;
    const double around = kind_ <= sac ? random_.uniform(0, 0.05) : 0;
    const Vector3d tint(random_.uniform(0.5, 0.75), random_.uniform(0.2, 0.4),
                        random_.uniform(0.15, 0.35));
    depth_ = Plane(camera_.width, camera_.height, INFINITY);
    std::vector<Vector3d> radiance(depth_.size(), Vector3d::Zero());
    std::vector<double> levels;
    for (int y = 0; y < camera_.height; ++y)
      for (int x = 0; x < camera_.width; ++x) {
        const Vector3d ray = unproject(camera_, {x + 0.5, y + 0.5}).normalized();
        const double range = hit_mm(ray);
        if (!std::isfinite(range)) continue;
        const Vector3d p = range * ray;
        depth_.at(x, y) = static_cast<float>(p.z());
        const double facing = std::max(0.0, -normal_at(p).dot(ray));
        const double light =
            std::pow(ray.z(), beam) * (1 - vignette * (1 - std::pow(ray.z(), 4))) / (range * range);
        const double second = smooth_step(-0.1, 0.1, sum(patches_, p));
        const double albedo = std::exp(texture * sum(texture_, p)) * (1 + second * (other - 1));
        const Vector3d paler(0, second * (other != 1) * 0.15, second * (other != 1) * 0.1);
        radiance[depth_.index(x, y)] =
            light * (albedo * facing * (tint + paler) +
                     Vector3d::Constant(4 * shine * std::pow(facing, 60)));
        levels.push_back(light * facing * tint.x());
      }
    const double white = quantile(std::move(levels), 0.97) / 0.85;
    picture_ = Rgb8Image(camera_.width, camera_.height);
    for (std::size_t k = 0; k < radiance.size(); ++k)
      for (int c = 0; c < 3; ++c) {
        const double linear = radiance[k][c] / white + around * tint[c];
        const double level = srgb8_from_linear(static_cast<float>(std::min(1.0, linear))) +
                             255 * noise * random_.normal();
        picture_.pixels[3 * k + c] =
            static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
      }
  }

  Kind kind_;
  RandomStream random_;
  double size_mm_, fold_ = 0, bump_ = 0;
  Intrinsics camera_;
  Waves bumps_, texture_, patches_;
  Vector3d middle_, radii_;
  Vector2d tilt_, bend_;
  Plane depth_;
  Rgb8Image picture_;
};

// Mean relative error at the best scale (of medians); of a plane across the axis without `depth`.
double scaled_error(const Plane& truth, const Plane& found, bool as_plane) {
  std::vector<double> off;
  for (std::size_t k = 0; k < truth.size(); ++k)
    if (std::isfinite(truth.values[k]) && std::isfinite(found.values[k]))
      off.push_back((as_plane ? 0 : std::log(found.values[k])) - std::log(truth.values[k]));
  const double middle = median(std::vector<double>(off));
  double sum = 0;
  for (const double value : off) sum += std::abs(std::expm1(value - middle));
  return sum / std::max<double>(1, static_cast<double>(off.size()));
}

// Of scenes that neither shares nor verdict were fitted to.
void run_relief(Bench& bench) {
  const int seeds = bench.count(2, 15, 50);
  double by_plane[2] = {}, worst = 0;
  int within = 0, within_ok = 0, beyond = 0, beyond_ok = 0;
  for (int kind = 0; kind < ScopeScene::kKinds; ++kind)
    for (int seed = 1; seed <= seeds; ++seed) {
      bench.now("relief, scene " + std::to_string(kind * seeds + seed));
      const ScopeScene scene(static_cast<ScopeScene::Kind>(kind), static_cast<std::uint64_t>(seed),
                             200);
      const FrameDepth found = shade_frame(prepare_frame(scene.picture(), scene.camera(), {}), {});
      const double error = scaled_error(scene.depth(), found.depth, false);
      const double ratio = error / scaled_error(scene.depth(), found.depth, true);
      by_plane[kind > ScopeScene::sac] += ratio / (2 * seeds);
      worst = std::max(worst, ratio);
      const bool ok = found.quality.verdict == DepthVerdict::ok;
      within += error <= 0.1;
      within_ok += ok && error <= 0.1;
      beyond += error > 0.2;
      beyond_ok += ok && error > 0.2;
    }
  const std::string of = std::to_string(2 * seeds);
  bench.at_most("relief of " + of + " tubes and sacs: error by a plane's, mean", "×", by_plane[0],
                0.6);
  bench.at_most("relief of " + of + " plates and organs: error by a plane's, mean", "×",
                by_plane[1], 0.88);
  bench.at_most("relief: error by a plane's, worst of all", "×", worst, 1.1);
  bench.at_least("shading within 10 %, of " + std::to_string(within) + ": called ok", "%",
                 within > 0 ? 100.0 * within_ok / within : 100, 85);
  bench.at_most("shading beyond 20 %, of " + std::to_string(beyond) + ": called ok", "", beyond_ok,
                0);
}

const RegisteredPart kRelief("relief", run_relief,
                             "shaded depth of tubes, sacs, plates and organs, and its verdict");

}  // namespace
}  // namespace organbake
