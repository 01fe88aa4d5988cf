// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/mechanics_model.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace organbake
