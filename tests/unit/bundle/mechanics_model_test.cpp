// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/mechanics_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

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
