// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

TEST(Material, DefaultsAreValid) { EXPECT_NO_THROW(Material().check()); }

TEST(Material, EachBoundIsKept) {
  const auto refused = [](auto change) {
    Material material;
    change(material);
    EXPECT_THROW(material.check(), UsageError);
    EXPECT_THROW(make_material_color(material), UsageError);
  };
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  refused([](auto& m) { m.albedo[0] = -0.1f; });
  refused([](auto& m) { m.albedo[2] = 1.1f; });
  refused([&](auto& m) { m.albedo[1] = not_a_number; });
  refused([](auto& m) { m.variation = 2; });
  refused([&](auto& m) { m.variation = not_a_number; });
  refused([](auto& m) { m.feature_mm = 0; });
  refused([&](auto& m) { m.feature_mm = not_a_number; });
  refused([](auto& m) { m.ambient = -1; });
  refused([](auto& m) { m.light_direction.setZero(); });
  refused([](auto& m) { m.light_direction[0] = std::numeric_limits<double>::infinity(); });
}

TEST(Material, WithoutVariationItIsAlbedoTimesLight) {
  Material material;
  material.variation = 0;
  material.light_direction = {0, 0, 4};
  const auto color = make_material_color(material);
  std::vector<Eigen::Vector3f> colors;
  color->shade({Vector3d(1, 2, 3), Vector3d(4, 5, 6), Vector3d(7, 8, 9)},
               {Vector3d::UnitZ(), Vector3d::UnitX(), -Vector3d::UnitZ()}, {{}, {}, {}}, colors);
  ASSERT_EQ(colors.size(), 3u);
  EXPECT_LT((colors[0] - material.albedo).norm(), 1e-6);
  EXPECT_LT((colors[1] - 0.35f * material.albedo).norm(), 1e-6);
  EXPECT_LT((colors[2] - 0.35f * material.albedo).norm(), 1e-6);
}

TEST(Material, VariesWithinReasonAndNeverBelowZero) {
  Material material;
  material.variation = 1;
  const auto color = make_material_color(material);
  const TriangleMesh sphere = sphere_mesh(40, 4);
  double least = 1, most = 0;
  for (const auto& sample :
       shade_through(sphere, *color, plain_camera({0, -150, 0}, Vector3d::Zero(), 64))) {
    EXPECT_TRUE(sample.color.allFinite());
    EXPECT_GE(sample.color.minCoeff(), 0);
    least = std::min<double>(least, sample.color.x());
    most = std::max<double>(most, sample.color.x());
  }
  EXPECT_GT(most, 2 * least);
}

}  // namespace
}  // namespace organbake
