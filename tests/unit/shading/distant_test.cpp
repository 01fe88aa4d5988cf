// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/distant.h"

#include <gmock/gmock.h>

#include <numbers>

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/shading/tsai_shah.h"

namespace organbake {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Two oblique lights; the bench has four on all surfaces at 128².
TEST(Distant, GaussAndPeaksWithinAPixelAndAHalfAndBetterThanTsaiShah) {
  for (const auto& [name, i] : {std::pair("gauss", 0), std::pair("peaks", 3)}) {
    const DistantLight light{(20 + 90 * i) * kDegree, (30 + 10 * (i % 2) + 10 * (i / 2)) * kDegree};
    const DistantScene scene = distant_scene(name, 128, light);
    DistantOptions options;
    options.light = light;
    const DistantEstimate estimate = shade_distant(scene.intensity, Mask(128, 128, 1), options);
    const double error = depth_error_px(estimate.depth, scene.depth);
    EXPECT_LT(error, 1.5) << name << " " << i;
    EXPECT_LT(error, 0.5 * depth_error_px(Plane(128, 128), scene.depth));
    EXPECT_FALSE(estimate.ambiguous);
    EXPECT_THAT(estimate.branch, testing::AnyOf("flat", "near", "far"));
  }
}

// An occluding rim, which no smooth sheet follows: without it both were 5 to 8 pixels off.
TEST(Distant, SolidsOnAPlainGroundHaveTheirRim) {
  for (const char* name : {"vase", "sphere"})
    for (double noise : {0.0, 0.02}) {
      const DistantLight light{20 * kDegree, 30 * kDegree};
      DistantScene scene = distant_scene(name, 128, light);
      if (noise > 0) add_noise(scene.intensity, noise, /*eight_bit=*/true, 1);
      DistantOptions options;
      options.light = light;
      const DistantEstimate estimate = shade_distant(scene.intensity, Mask(128, 128, 1), options);
      EXPECT_EQ(estimate.branch, "solid") << name << " " << noise;
      EXPECT_LT(depth_error_px(estimate.depth, scene.depth), 1.5) << name << " " << noise;
    }
}

TEST(Distant, SheetsWithoutARimAreNoSolids) {
  for (const char* name : {"gauss", "sombrero", "peaks"}) {
    const DistantLight light{110 * kDegree, 50 * kDegree};
    DistantScene scene = distant_scene(name, 64, light);
    add_noise(scene.intensity, 0.02, /*eight_bit=*/true, 2);
    DistantOptions options;
    options.light = light;
    EXPECT_NE(shade_distant(scene.intensity, Mask(64, 64, 1), options).branch, "solid") << name;
  }
}

TEST(Distant, NoSurfaceIsWorseThanTheFlatPlane) {
  for (const std::string& name : distant_scene_names()) {
    const DistantLight light{110 * kDegree, 40 * kDegree};
    const DistantScene scene = distant_scene(name, 64, light);
    DistantOptions options;
    options.light = light;
    const DistantEstimate estimate = shade_distant(scene.intensity, Mask(64, 64, 1), options);
    EXPECT_LT(depth_error_px(estimate.depth, scene.depth),
              depth_error_px(Plane(64, 64), scene.depth))
        << name;
  }
}

TEST(Distant, SaysThatFrontalLightIsAmbiguous) {
  const DistantScene scene = distant_scene("gauss", 32, {0, 0});
  const DistantEstimate estimate = shade_distant(scene.intensity, Mask(32, 32, 1), {});
  EXPECT_TRUE(estimate.ambiguous);
  EXPECT_TRUE(all_finite(estimate.depth));
}

TEST(Distant, BoundsAreChecked) {
  EXPECT_NO_THROW(DistantOptions().check());
  DistantOptions options;
  options.light.slant_rad = 2;
  EXPECT_THROW(options.check(), UsageError);
  options = {};
  options.albedo = 0;
  EXPECT_THROW(options.check(), UsageError);
}

}  // namespace
}  // namespace organbake
