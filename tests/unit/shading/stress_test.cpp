// SPDX-License-Identifier: GPL-3.0-or-later
// Whatever comes in, what goes out is finite and bounded, and never much worse than a flat plane.
#include <gmock/gmock.h>

#include <array>
#include <limits>
#include <numbers>

#include "known_depth.h"
#include "organbake/shading/distant.h"
#include "organbake/shading/laparoscope.h"

namespace organbake {
namespace {

Intrinsics camera_of(int width, int height) {
  Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = std::max(width, height);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

void expect_sane(const Plane& intensity, const std::string& what) {
  const Mask inside(intensity.width, intensity.height, 1);
  const RangeEstimate near =
      shade_laparoscope(intensity, inside, camera_of(intensity.width, intensity.height), {});
  EXPECT_TRUE(all_finite(near.log_range)) << what;
  for (float v : near.log_range.values) ASSERT_LT(std::abs(v), 50) << what;
  const DistantEstimate far = shade_distant(intensity, inside, {});
  EXPECT_TRUE(all_finite(far.depth)) << what;
}

TEST(ShadingStress, ConstantBlackSaturatedAndTinyImages) {
  expect_sane(Plane(40, 30, 0.5F), "constant");
  expect_sane(Plane(40, 30, 0.0F), "black");
  expect_sane(Plane(40, 30, 1.0F), "saturated");
  expect_sane(Plane(64, 1, 0.7F), "one row");
  expect_sane(Plane(1, 64, 0.7F), "one column");
  expect_sane(Plane(1, 1, 0.7F), "one pixel");
  expect_sane(Plane(3, 2, 0.7F), "six pixels");
}

TEST(ShadingStress, NotFinitePixelsDoNotCount) {
  NearScene scene = near_scene(0.5, 64);
  scene.intensity.at(20, 20) = std::numeric_limits<float>::quiet_NaN();
  scene.intensity.at(40, 30) = std::numeric_limits<float>::infinity();
  scene.intensity.at(10, 50) = -3;
  const RangeEstimate estimate =
      shade_laparoscope(scene.intensity, Mask(64, 64, 1), scene.camera, {});
  EXPECT_LT(relative_error_percent(estimate.log_range, scene.log_range), 0.5);
  expect_sane(Plane(20, 20, std::numeric_limits<float>::quiet_NaN()), "all NaN");
}

TEST(ShadingStress, GainDoesNotMatter) {
  const NearScene scene = near_scene(0.5, 64);
  const RangeEstimate usual = shade_laparoscope(scene.intensity, Mask(64, 64, 1), scene.camera, {});
  for (float gain : {1e-6F, 1e6F}) {
    Plane other = scene.intensity;
    for (float& value : other.values) value *= gain;
    const RangeEstimate estimate = shade_laparoscope(other, Mask(64, 64, 1), scene.camera, {});
    EXPECT_LT(largest_difference(estimate.log_range, usual.log_range), 1e-3) << gain;
  }
}

// Tilts all round, each with the next of the slants, the singular ones among them.
TEST(ShadingStress, DistantLightsFromEverywhere) {
  constexpr std::array kSlants = {0.0, 0.4, 1.0, 0.5 * std::numbers::pi};
  for (std::size_t tilt = 0; tilt < 8; ++tilt) {
    const double slant = kSlants[tilt % kSlants.size()];
    const DistantLight light{static_cast<double>(tilt) * 0.25 * std::numbers::pi, slant};
    const DistantScene scene = distant_scene("gauss", 32, light);
    DistantOptions options;
    options.light = light;
    const DistantEstimate estimate = shade_distant(scene.intensity, Mask(32, 32, 1), options);
    ASSERT_TRUE(all_finite(estimate.depth));
    // Under frontal light hill and hollow look alike: no error can be promised there.
    if (slant == 0) continue;
    EXPECT_LT(depth_error_px(estimate.depth, scene.depth),
              1.1 * depth_error_px(Plane(32, 32), scene.depth))
        << tilt << " " << slant;
  }
}

}  // namespace
}  // namespace organbake
