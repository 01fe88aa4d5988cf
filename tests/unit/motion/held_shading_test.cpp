// SPDX-License-Identifier: GPL-3.0-or-later
#include "held_shading.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

// Glossy tissue: parallax is sure round it and tells nothing on the dome in its middle.
struct GlossyDome {
  BumpyView view;
  PreparedFrame frame;
  SweptDepth swept;
  Mask hole;

  GlossyDome() {
    const BumpyScene scene{.bump_mm = 5, .texture = 0};
    view = bumpy_clip(scene, 1)[0];
    frame = prepared_of(view);
    const int width = view.light.width, height = view.light.height;
    swept = {view.depth_mm, Plane(width, height, 0.005F), Plane(width, height, 0.8F)};
    hole = Mask(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (std::hypot(x - 0.5 * width, y - 0.5 * height) > 28) continue;
        hole.at(x, y) = 1;
        swept.confidence.at(x, y) = 0;
        swept.depth.at(x, y) = std::numeric_limits<float>::infinity();
      }
  }
};

TEST(HeldShading, GivesAGlossyDomeItsCurvature) {
  const GlossyDome dome;
  const FrameDepth shaded = fill_by_shading(dome.frame, dome.swept, {.reach_share = 0.4});
  PreparedFrame blind = dome.frame;
  blind.diffuse = Mask(blind.diffuse.width, blind.diffuse.height);
  const FrameDepth bridged = fill_by_shading(blind, dome.swept, {.reach_share = 0.4});
  const double with = median_error(shaded.depth, dome.view.depth_mm, dome.hole);
  const double without = median_error(bridged.depth, dome.view.depth_mm, dome.hole);
  EXPECT_LT(with, 0.6 * without) << "bridged " << without;
  EXPECT_LT(with, 0.012);
}

TEST(HeldShading, TakesNoSlowChangeFromBrightness) {
  GlossyDome dome;
  dome.swept.confidence = Plane(dome.hole.width, dome.hole.height, 0.8F);
  dome.swept.depth = dome.view.depth_mm;
  // A beam that lights the left three times as much as the right.
  for (int y = 0; y < dome.hole.height; ++y)
    for (int x = 0; x < dome.hole.width; ++x)
      dome.frame.intensity.at(x, y) *= std::exp(-1.1F * float(x) / float(dome.hole.width));
  const FrameDepth depth = fill_by_shading(dome.frame, dome.swept, {});
  EXPECT_LT(median_error(depth.depth, dome.view.depth_mm), 0.004);
}

TEST(HeldShading, LetsStrayMatchesGo) {
  GlossyDome dome;
  dome.swept.confidence = Plane(dome.hole.width, dome.hole.height, 0.8F);
  dome.swept.depth = dome.view.depth_mm;
  RandomStream random(5, 0);
  for (float& depth : dome.swept.depth.values)
    if (random.uniform() < 0.1) depth *= static_cast<float>(0.6 + 0.8 * random.uniform());
  const FrameDepth depth = fill_by_shading(dome.frame, dome.swept, {});
  EXPECT_LT(median_error(depth.depth, dome.view.depth_mm), 0.006);
  EXPECT_GT(known_share(depth.depth), 0.99);
}

TEST(HeldShading, SaysNothingFarFromParallax) {
  GlossyDome dome;
  for (int y = 0; y < dome.hole.height; ++y)
    for (int x = 40; x < dome.hole.width; ++x) dome.swept.confidence.at(x, y) = 0;
  const FrameDepth depth = fill_by_shading(dome.frame, dome.swept, {});
  EXPECT_TRUE(std::isfinite(depth.depth.at(20, 60)));
  EXPECT_FALSE(std::isfinite(depth.depth.at(140, 60)));
  EXPECT_EQ(depth.confidence.at(140, 60), 0);
}

TEST(HeldShading, RefusesWhatItCannotHold) {
  GlossyDome dome;
  EXPECT_NO_THROW(HeldShadingOptions{}.check());
  EXPECT_THROW(HeldShadingOptions{.texture = 0}.check(), UsageError);
  EXPECT_THROW(HeldShadingOptions{.albedo_share = 0}.check(), UsageError);
  EXPECT_THROW(HeldShadingOptions{.reach_share = 2}.check(), UsageError);
  SweptDepth small = dome.swept;
  small.depth = Plane(3, 3);
  EXPECT_THROW(fill_by_shading(dome.frame, small, {}), BadDataError);
  dome.swept.confidence = Plane(dome.hole.width, dome.hole.height);
  EXPECT_THROW(fill_by_shading(dome.frame, dome.swept, {}), BadDataError);
}

}  // namespace
}  // namespace organbake
