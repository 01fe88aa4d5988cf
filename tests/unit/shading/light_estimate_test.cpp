// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/light_estimate.h"

#include <gmock/gmock.h>

#include <numbers>

#include "known_depth.h"

namespace organbake {
namespace {

constexpr double kOneDegree = std::numbers::pi / 180;

double angle_degrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0)) / kOneDegree;
}

// Up to the convex/concave flip, which turns the tilt by π.
double error_degrees(DistantLight found, const DistantLight& truth) {
  const double straight = angle_degrees(found.toward(), truth.toward());
  found.tilt_rad += std::numbers::pi;
  return std::min(straight, angle_degrees(found.toward(), truth.toward()));
}

TEST(LightEstimate, ThirtyTwoLightsOnThreeSurfaces) {
  for (const char* name : {"vase", "sphere", "gauss"}) {
    double sum = 0, worst = 0;
    for (int tilt = 0; tilt < 8; ++tilt)
      for (double slant : {15., 30., 45., 60.}) {
        const DistantLight light{tilt * 45 * kOneDegree + 0.1, slant * kOneDegree};
        const DistantScene scene = distant_scene(name, 96, light);
        const double error =
            error_degrees(estimate_light(scene.intensity, Mask(96, 96, 1)).light, light);
        sum += error;
        worst = std::max(worst, error);
      }
    EXPECT_LT(sum / 32, 5) << name;
    EXPECT_LT(worst, 15) << name;
  }
}

TEST(LightEstimate, AlbedoIsFoundAndGainDoesNotMatter) {
  const DistantLight light{0.7, 0.6};
  DistantScene scene = distant_scene("sphere", 96, light);
  for (float& value : scene.intensity.values) value *= 1e-3F;
  const LightEstimate estimate = estimate_light(scene.intensity, Mask(96, 96, 1));
  EXPECT_NEAR(estimate.albedo, 1e-3, 3e-5);
  EXPECT_LT(error_degrees(estimate.light, light), 3);
}

TEST(LightEstimate, SaysWhenNothingCanBeTold) {
  const LightEstimate flat = estimate_light(Plane(16, 16, 0.5F), Mask(16, 16, 1));
  EXPECT_TRUE(flat.frontal);
  EXPECT_GT(flat.tilt_error_rad, 3);
  EXPECT_TRUE(estimate_light(Plane(16, 16), Mask(16, 16, 0)).frontal);
}

TEST(LightEstimate, UncertaintyGrowsTowardsFrontalLight) {
  const auto uncertainty = [](double slant) {
    const DistantScene scene = distant_scene("sphere", 96, {0.3, slant * kOneDegree});
    return estimate_light(scene.intensity, Mask(96, 96, 1)).tilt_error_rad;
  };
  EXPECT_GT(uncertainty(8), uncertainty(45));
}

}  // namespace
}  // namespace organbake
