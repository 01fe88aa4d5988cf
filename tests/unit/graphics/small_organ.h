// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/core/error.h"
#include "organbake/graphics/graphics_drawing.h"
#include "organbake/warp/view.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {

using Positions = std::vector<Eigen::Vector3d>;

// Wet tissue in a lamp's light, for a light at the scope.
inline Lighting tissue_light() {
  Lighting light;
  light.ambient_above = {0.5, 0.5, 0.5};
  light.ambient_below = {0.3, 0.3, 0.3};
  light.lamps.push_back({Eigen::Vector3d(1, -2, 2).normalized(), {0.5, 0.5, 0.5}});
  light.gloss = wet_gloss();
  light.scope = ScopeLight();
  light.finish.relief_slope = 0.2;
  light.finish.softness = {0.3, 0.2, 0.15};
  light.finish.rim = 0.5;
  light.finish.grain = {0.08, 0.1, 0.1};
  light.finish.border_fade_rad = 0.02;
  return light;
}

inline Bundle small_organ(const Eigen::Vector3d& center, int map_size) {
  SyntheticOptions options;
  options.organ.center = center;
  options.organ.lump_share = 0.06;
  options.map_size = map_size;
  options.proxy_subdivisions = 2;
  Bundle bundle = make_synthetic_bundle(options);
  bundle.lighting = tissue_light();
  return bundle;
}

inline const Bundle& tested_organ() {
  static const Bundle bundle = small_organ({10, -20, 30}, 256);
  return bundle;
}

inline View view_at(const Bundle& bundle, const Eigen::Vector3d& direction, double away_mm) {
  View view;
  view.camera.intrinsics = {640, 360, 420, 420, 320, 180};
  const Eigen::Vector3d center = bundle.cameras.manifold.center_world_mm;
  view.camera.camera_from_world =
      look_at(center + away_mm * direction.normalized(), center, Eigen::Vector3d::UnitZ());
  return view;
}

// Skipped where no driver answers.
class GraphicsTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      const OffscreenContext context;
    } catch (const UsageError& error) {
      GTEST_SKIP() << "nothing was drawn with graphics hardware: " << error.what();
    }
  }
};

}  // namespace organbake
