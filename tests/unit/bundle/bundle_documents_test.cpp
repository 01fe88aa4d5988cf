// SPDX-License-Identifier: Apache-2.0

#include "organbake/bundle/lighting.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/error.h"
#include "support/organs.h"
#include "support/testing.h"

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

TEST(MechanicsModel, RoundTripIsExact) {
  MechanicsModel model = small_bundle().mechanics;
  model.anchors = {1};
  for (const auto& order : std::vector<std::vector<std::uint32_t>>{{}, {3, 0, 2}}) {
    model.elimination_order = order;
    const std::string text = mechanics_to_json(model);
    const MechanicsModel read = mechanics_from_json(text, "m", 4);
    EXPECT_EQ(read.elimination_order, order);
    EXPECT_EQ(mechanics_to_json(read), text);
  }
}

TEST(MechanicsModel, RefusesWhatTheDeformerCouldNotBear) {
  const auto refused = [](auto change) {
    MechanicsModel model = small_bundle().mechanics;
    change(model);
    EXPECT_THROW(mechanics_from_json(mechanics_to_json(model), "m", 4), BadDataError);
  };
  refused([](auto& m) { m.mass_kg[2] = 0; });
  refused([](auto& m) { m.mass_kg.pop_back(); });
  refused([](auto& m) { m.springs[0].b = 4; });
  refused([](auto& m) { m.springs[0].b = m.springs[0].a; });
  refused([](auto& m) { m.springs[0].rest_length_mm = 0; });
  refused([](auto& m) { m.springs[0].stiffness_n_per_mm = -1; });
  refused([](auto& m) { m.springs[0].damping_n_s_per_mm = -1; });
  refused([](auto& m) { m.anchors = {1, 1}; });
  refused([](auto& m) { m.anchors = {9}; });
  refused([](auto& m) { m.volume_stiffness = 2; });
  refused([](auto& m) { m.drag_per_s = 1e13; });
  const auto refused_order = [&](std::vector<std::uint32_t> order) {
    refused([&](auto& m) { m.anchors = {1}, m.elimination_order = order; });
  };
  refused_order({0, 2});
  refused_order({0, 2, 4});
  refused_order({0, 2, 2});
  refused_order({0, 2, 1});
  refused_order({0, 2, 3, 3});
}

MechanicsModel with_body() {
  MechanicsModel model = small_bundle().mechanics;
  model.body = small_body();
  return model;
}

TEST(TetrahedralBody, RoundTripIsExact) {
  const std::string text = mechanics_to_json(with_body());
  const MechanicsModel model = mechanics_from_json(text, "m", 4);
  ASSERT_TRUE(model.body);
  EXPECT_EQ(model.body->tetrahedra.size(), 2u);
  EXPECT_EQ(mechanics_to_json(model), text);
}

TEST(TetrahedralBody, PatchesRoundTripExactlyAndAreChecked) {
  MechanicsModel model = with_body();
  model.body->patches.assign(4, {{0, 0.3}, {2, 1.1}, {4, -0.4}});
  model.body->patches[1] = {{1, 1}};
  const std::string text = mechanics_to_json(model);
  const MechanicsModel read = mechanics_from_json(text, "m", 4);
  ASSERT_EQ(read.body->patches.size(), 4u);
  EXPECT_EQ(mechanics_to_json(read), text);
  std::size_t carriers = 0;
  each_carrier(*read.body, 0, [&](std::uint32_t, double) { ++carriers; });
  EXPECT_EQ(carriers, 3u);
  const auto refused = [&](auto change) {
    MechanicsModel changed = model;
    change(changed.body->patches);
    EXPECT_THROW(mechanics_from_json(mechanics_to_json(changed), "m", 4), BadDataError);
  };
  refused([](auto& p) { p.pop_back(); });
  refused([](auto& p) { p[2][0].node = 5; });
  refused([](auto& p) { p[2][0].weight = 0.4; });
  refused([](auto& p) { p[2][0].weight = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& p) { p[2] = {{0, 3}, {1, -2}}; });
  refused([](auto& p) { p[3].clear(); });
}

TEST(TetrahedralBody, GiveRoundTripsExactlyAndIsChecked) {
  MechanicsModel model = with_body();
  model.body->give_mm_per_n = {0, 0.1, 7, 1e-5};
  const std::string text = mechanics_to_json(model);
  EXPECT_EQ(mechanics_from_json(text, "m", 4).body->give_mm_per_n, model.body->give_mm_per_n);
  for (const double wrong : {-1e-3, std::numeric_limits<double>::quiet_NaN()}) {
    model.body->give_mm_per_n[2] = wrong;
    EXPECT_THROW(mechanics_from_json(mechanics_to_json(model), "m", 4), BadDataError);
  }
  model.body->give_mm_per_n = {1, 1, 1};
  EXPECT_THROW(mechanics_from_json(mechanics_to_json(model), "m", 4), BadDataError);
}

TEST(TetrahedralBody, BundlesWithoutOneAreRead) {
  const MechanicsModel model =
      mechanics_from_json(mechanics_to_json(small_bundle().mechanics), "m", 4);
  EXPECT_FALSE(model.body);
}

TEST(TetrahedralBody, VolumeIsSigned) {
  const TetrahedralBody body = *with_body().body;
  EXPECT_NEAR(volume_of(body, body.tetrahedra[0]), 4.5, 1e-12);
  EXPECT_NEAR(volume_of(body, {{0, 2, 1, 3}}), -4.5, 1e-12);
}

TEST(TetrahedralBody, RefusesWhatTheSolverCouldNotBear) {
  const auto refused = [](auto change) {
    MechanicsModel model = with_body();
    change(*model.body);
    EXPECT_THROW(mechanics_from_json(mechanics_to_json(model), "m", 4), BadDataError);
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  refused([](auto& b) { b.poisson_ratio = 0.5; });
  refused([](auto& b) { b.poisson_ratio = -0.1; });
  refused([](auto& b) { b.damping_s = -0.01; });
  refused([](auto& b) { b.nodes_mm[1].x() = kNaN; });
  refused([](auto& b) { b.nodes_mm[1].x() = 1e9; });
  refused([](auto& b) { b.nodes_mm.clear(); });
  refused([](auto& b) { b.tetrahedra[1].nodes[2] = 5; });
  refused([](auto& b) { b.tetrahedra[1].nodes[2] = b.tetrahedra[1].nodes[1]; });
  refused([](auto& b) { std::swap(b.tetrahedra[0].nodes[0], b.tetrahedra[0].nodes[1]); });
  refused([](auto& b) { b.tetrahedra[0].fill = 0; });
  refused([](auto& b) { b.tetrahedra[0].fill = 1.5; });
  refused([](auto& b) { b.tetrahedra[0].fill = kNaN; });
  refused([](auto& b) { b.tetrahedra.clear(); });
  refused([](auto& b) { b.vertices.pop_back(); });
  refused([](auto& b) { b.vertices[2].tetrahedron = 2; });
  refused([](auto& b) { b.vertices[2].weights = {0.5, 0.5, 0.5, -0.5}; });
  refused([](auto& b) { b.vertices[2].weights = {0.5, 0.5, 0.5, 0}; });
  refused([](auto& b) { b.vertices[2].weights[0] = kNaN; });
  refused([](auto& b) { b.anchors = {0, 5}; });
  refused([](auto& b) { b.anchors = {3, 0}; });
}

}  // namespace
}  // namespace organbake
