// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/contour/contour.h"

#include <gtest/gtest.h>

#include <cmath>

#include "capped_field.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

TEST(Contour, CrossesEdgesWhereTheValuesSay) {
  // One voxel at 3 in zeros, level 1: crossings two thirds of an edge away from it.
  std::vector<std::int16_t> values(27, 0);
  values[13] = 3;
  const TriangleMesh mesh = contour(std::span<const std::int16_t>(values), {3, 3, 3}, 1);
  EXPECT_EQ(mesh.vertices.size(), 6u);
  EXPECT_EQ(mesh.faces.size(), 8u);
  for (const Eigen::Vector3d& v : mesh.vertices) {
    EXPECT_NEAR((v - Eigen::Vector3d(1, 1, 1)).norm(), 2.0 / 3, 1e-6);
  }
  EXPECT_GT(signed_volume(mesh), 0);
}

TEST(Contour, KeepsCrossingsOffTheGridPoints) {
  std::vector<float> values(27, 0.0f);
  values[13] = 1;
  for (const double level : {1e-4, 0.9999}) {
    const TriangleMesh mesh = contour(std::span<const float>(values), {3, 3, 3}, level);
    for (const Eigen::Vector3d& v : mesh.vertices) {
      const double away = (v - Eigen::Vector3d(1, 1, 1)).norm();
      EXPECT_GE(away, 1.0 / 256 - 1e-6);
      EXPECT_LE(away, 1 - 1.0 / 256 + 1e-6);
    }
  }
}

TEST(Contour, OfNothingIsEmpty) {
  const std::vector<float> values(27, 0.0f);
  EXPECT_TRUE(contour(std::span<const float>(values), {3, 3, 3}, 0.5).empty());
}

TEST(CappedField, IsTheVolumeItselfWhenNothingReachesTheBorder) {
  const Volume ct = scan_of(ball({0, 0, 0}, 8), grid_around_origin({1, 1, 1}, 40));
  const CappedField<std::int16_t> field(ct.voxels, ct.size, value_range(ct), -300.5, true);
  std::vector<std::int16_t> copy;
  EXPECT_EQ(field.slices(0, ct.size[2], copy).data(), ct.voxels.data());
  EXPECT_EQ(field.margin(), 0);
}

TEST(CappedField, MirrorsTheBorderAtTheLevel) {
  Volume ct;
  ct.size = {2, 2, 2};
  ct.voxels = {100, 100, 100, 100, 100, 100, 100, -1000};
  const CappedField<std::int16_t> field(ct.voxels, ct.size, value_range(ct), -300.5, true);
  EXPECT_EQ(field.size(), (std::array<int, 3>{4, 4, 4}));
  std::vector<std::int16_t> copy;
  const auto values = field.slices(0, 4, copy);
  const auto at = [&](int i, int j, int k) { return values[(k * 4 + j) * 4 + i]; };
  EXPECT_EQ(at(1, 1, 1), 100);
  EXPECT_EQ(at(0, 1, 1), -701);  // 2 · −300.5 − 100: the crossing falls half-way
  EXPECT_EQ(at(1, 1, 0), -701);
  EXPECT_LT(at(0, 0, 1), -300.5);
  EXPECT_LT(at(3, 2, 2), -300.5);  // beside the voxel of air
}

}  // namespace
}  // namespace organbake
