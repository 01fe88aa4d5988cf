// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/lighting.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "organbake/core/error.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Lighting one_lamp() {
  return {.ambient_above = {0.4, 0.4, 0.4},
          .ambient_below = {0.2, 0.2, 0.2},
          .up = Vector3d::UnitZ(),
          .lamps = {{Vector3d::UnitX(), {1, 2, 3}}},
          .gloss = {{0.5, 10}},
          .scope = {},
          .finish = {}};
}

TEST(Lighting, RoundTripIsExact) {
  const std::string text = lighting_to_json(one_lamp());
  EXPECT_EQ(lighting_to_json(lighting_from_json(text, "l")), text);
}

Lighting scope_lit() {
  Lighting lighting = one_lamp();
  lighting.scope = ScopeLight{{1.5, -2, 0.25}, 90, 0.5, 1.25};
  lighting.finish = {0.1, 1.5, {0.3, 0.2, 0.1}, 0.25};
  return lighting;
}

TEST(Lighting, RoundTripWithALightAtTheScopeIsExact) {
  const Lighting light = scope_lit(), read = lighting_from_json(lighting_to_json(light), "l");
  EXPECT_EQ(read.scope, light.scope);
  EXPECT_EQ(read.finish, light.finish);
  EXPECT_EQ(lighting_to_json(read), lighting_to_json(light));
}

TEST(Lighting, OnlyWhatNeedsItIsOfTheSecondSchema) {
  EXPECT_NE(lighting_to_json(one_lamp()).find("organbake/lighting/1"), std::string::npos);
  EXPECT_NE(lighting_to_json(scope_lit()).find("organbake/lighting/2"), std::string::npos);
  Lighting soft = one_lamp();
  soft.finish.softness = {0.1, 0, 0};
  EXPECT_EQ(lighting_from_json(lighting_to_json(soft), "l").finish, soft.finish);
  EXPECT_NE(lighting_to_json(soft).find("lighting/2"), std::string::npos);
  soft.finish.grain = {0.1, 0.2, 0.3}, soft.finish.grain_mm = 0.7;
  EXPECT_EQ(lighting_from_json(lighting_to_json(soft), "l").finish, soft.finish);
  EXPECT_NE(lighting_to_json(soft).find("lighting/3"), std::string::npos);
  soft.finish.border_fade_rad = 0.02;
  EXPECT_EQ(lighting_from_json(lighting_to_json(soft), "l").finish, soft.finish);
  EXPECT_NE(lighting_to_json(soft).find("lighting/4"), std::string::npos);
}

TEST(Lighting, RefusesALightAtTheScopeThatThereCannotBe) {
  const auto refused = [](const std::function<void(Lighting&)>& change) {
    Lighting light = scope_lit();
    change(light);
    EXPECT_THROW(lighting_from_json(lighting_to_json(light), "l"), BadDataError);
  };
  refused([](Lighting& l) { l.scope->gain = 1e9; });
  refused([](Lighting& l) { l.scope->gain = 0; });
  refused([](Lighting& l) { l.scope->gain = NAN; });
  refused([](Lighting& l) { l.scope->reference_mm = -1; });
  refused([](Lighting& l) { l.scope->beam_half_angle_rad = 0; });
  refused([](Lighting& l) { l.scope->beam_half_angle_rad = 1.6; });
  refused([](Lighting& l) { l.scope->offset_mm = {0, 0, 2000}; });
  refused([](Lighting& l) { l.scope->offset_mm[1] = NAN; });
  refused([](Lighting& l) { l.finish.relief_slope = 2; });
  refused([](Lighting& l) { l.finish.relief_mm = 0; });
  refused([](Lighting& l) { l.finish.softness[2] = -0.1; });
  refused([](Lighting& l) { l.finish.rim = 1.5; });
  refused([](Lighting& l) { l.finish.grain = {0.1, -0.1, 0}; });
  refused([](Lighting& l) { l.finish.grain = {0.1, 0, 0}, l.finish.grain_mm = 0; });
  refused([](Lighting& l) { l.finish.border_fade_rad = 2; });
}

TEST(Lighting, AMistypedKeyOfTheScopeIsSaid) {
  std::string text = lighting_to_json(scope_lit());
  text.replace(text.find("reference_mm"), 12, "referense_mm");
  EXPECT_THROW(lighting_from_json(text, "l"), BadDataError);
}

TEST(Lighting, IsTheSkyAndTheLamps) {
  const Lighting light = one_lamp();
  EXPECT_TRUE(light.diffuse(Vector3d::UnitZ()).isApprox(Vector3d::Constant(0.4)));
  EXPECT_TRUE(light.diffuse(-Vector3d::UnitZ()).isApprox(Vector3d::Constant(0.2)));
  EXPECT_TRUE(light.diffuse(Vector3d::UnitX()).isApprox(Vector3d(1.3, 2.3, 3.3)));
  EXPECT_TRUE(light.diffuse(-Vector3d::UnitX()).isApprox(Vector3d::Constant(0.3)));
}

TEST(Lighting, GlossIsBrightestHalfWayBetweenLampAndEye) {
  const Lighting light = one_lamp();
  const Vector3d eye = Vector3d::UnitY(), half = (eye + Vector3d::UnitX()).normalized();
  EXPECT_TRUE(light.glossy(half, eye).isApprox(0.5 * Vector3d(1, 2, 3)));
  const Vector3d tilted = Eigen::AngleAxisd(0.2, Vector3d::UnitZ()) * half;
  EXPECT_TRUE(
      light.glossy(tilted, eye).isApprox(0.5 * std::pow(std::cos(0.2), 10) * Vector3d(1, 2, 3)));
  EXPECT_EQ(light.glossy(-Vector3d::UnitX(), eye), Vector3d::Zero()) << "behind the lamp";
}

TEST(Lighting, RefusesWhatIsNoLight) {
  const auto refused = [](const std::function<void(Lighting&)>& change) {
    Lighting light = one_lamp();
    change(light);
    EXPECT_THROW(lighting_from_json(lighting_to_json(light), "l"), BadDataError);
  };
  refused([](Lighting& l) { l.ambient_above[1] = -0.1; });
  refused([](Lighting& l) { l.lamps[0].color[0] = 1e9; });
  refused([](Lighting& l) { l.lamps[0].toward = Vector3d::Zero(); });
  refused([](Lighting& l) { l.up = Vector3d::Zero(); });
  refused([](Lighting& l) { l.gloss[0].exponent = 0; });
  refused([](Lighting& l) { l.gloss[0].strength = NAN; });
  refused([](Lighting& l) { l.lamps.resize(17, l.lamps[0]); });
  refused([](Lighting& l) {
    l.lamps.clear();
    l.ambient_above = l.ambient_below = Vector3d::Zero();
  });
}

TEST(Lighting, DirectionsMayHaveAnyLength) {
  Lighting light = one_lamp();
  light.lamps[0].toward = {250, 0, 0};
  const Lighting read = lighting_from_json(lighting_to_json(light), "l");
  EXPECT_TRUE(read.lamps[0].toward.isApprox(Vector3d::UnitX()));
}

}  // namespace
}  // namespace organbake
