// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/distant.h"

#include <gmock/gmock.h>

#include <numbers>

#include "core/error.h"
#include "known_depth.h"
#include "shading/tsai_shah.h"

namespace organbake {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Four oblique lights; the bench has them all on all surfaces at 128².
TEST(Distant, GaussAndPeaksWithinAPixelAndAHalfAndBetterThanTsaiShah) {
  for (const char* name : {"gauss", "peaks"})
    for (int i : {0, 3}) {
      const DistantLight light{(20 + 90 * i) * kDegree,
                               (30 + 10 * (i % 2) + 10 * (i / 2)) * kDegree};
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
