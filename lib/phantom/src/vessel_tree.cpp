// SPDX-License-Identifier: GPL-3.0-or-later
#include "vessel_tree.h"

#include <cmath>
#include <numbers>

#include "organbake/core/random.h"

namespace organbake {
namespace {

struct Tip {
  Eigen::Vector2d at_mm;
  double heading_rad, radius_mm;
};

constexpr double kLeastRadius_mm = 0.07;
constexpr double kTaper = 0.012;      // of the radius, a step
constexpr double kWander_rad = 0.14;  // a step, standard deviation
constexpr double kFork = 0.025;       // chance of it, a step
constexpr double kChild = 0.62;       // radius of a branch by its stem's
constexpr double kForkAngle_rad = 0.7;

void grow(Tip tip, RandomStream& random, std::vector<Tip>& branches, std::vector<VesselSpot>& spots,
          const Eigen::Vector2d& reach_mm) {
  while (tip.radius_mm > kLeastRadius_mm && (tip.at_mm.cwiseAbs() - reach_mm).maxCoeff() < 0) {
    spots.push_back({tip.at_mm, tip.radius_mm});
    tip.heading_rad += kWander_rad * random.normal();
    tip.at_mm +=
        0.8 * tip.radius_mm * Eigen::Vector2d(std::cos(tip.heading_rad), std::sin(tip.heading_rad));
    tip.radius_mm *= 1 - kTaper;
    if (random.uniform() > kFork) continue;
    const double side = random.uniform() < 0.5 ? -1 : 1;
    branches.push_back({tip.at_mm,
                        tip.heading_rad + side * kForkAngle_rad * random.uniform(0.6, 1.3),
                        kChild * tip.radius_mm});
  }
}

}  // namespace

std::vector<VesselSpot> grow_vessels(std::uint64_t seed, int count,
                                     const Eigen::Vector2d& reach_mm) {
  std::vector<VesselSpot> spots;
  for (int tree = 0; tree < count; ++tree) {
    RandomStream random(seed, static_cast<std::uint64_t>(tree));
    const double x = random.uniform(-reach_mm.x(), reach_mm.x());
    const double y = random.uniform(-reach_mm.y(), reach_mm.y());
    // Thin ones are the more frequent.
    const double radius = 0.15 * std::pow(6.5, std::pow(random.uniform(), 3));
    std::vector<Tip> tips = {{{x, y}, random.uniform(0, 2 * std::numbers::pi), radius}};
    while (!tips.empty()) {
      const Tip tip = tips.back();
      tips.pop_back();
      grow(tip, random, tips, spots, reach_mm);
    }
  }
  return spots;
}

}  // namespace organbake
