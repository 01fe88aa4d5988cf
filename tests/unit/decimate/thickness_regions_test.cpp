// SPDX-License-Identifier: GPL-3.0-or-later
#include "thickness_regions.h"

#include <gtest/gtest.h>

#include "organbake/core/parallel.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// What chords from some thousand faces tell of a mean.
constexpr double kSampling = 0.03;

double only_thickness_mm(const TriangleMesh& mesh) {
  const ThicknessRegions regions = thickness_regions(mesh);
  EXPECT_EQ(regions.thickness_mm.size(), 1u);
  return regions.thickness_mm.empty() ? 0 : regions.thickness_mm.front();
}

TEST(ThicknessRegions, ABodyOfOneThicknessIsTwiceItsVolumeByItsArea) {
  EXPECT_NEAR(only_thickness_mm(sphere_mesh(30, 4)), 20, 0.2);
  EXPECT_NEAR(only_thickness_mm(torus_mesh(40, 3, 120, 24)), 3, 3 * kSampling);
  const TriangleMesh plate = grid_box({60, 60, 4}, 20);
  EXPECT_NEAR(only_thickness_mm(plate), 2 * signed_volume(plate) / surface_area(plate),
              4 * kSampling);
  EXPECT_NEAR(only_thickness_mm(inside_out(sphere_mesh(30, 4))), 20, 0.2);
}

TEST(ThicknessRegions, AVesselThatLeavesAnOrganHasItsOwn) {
  const TriangleMesh mesh = ball_with_stalk(30, 3, 60);
  const ThicknessRegions regions = thickness_regions(mesh);
  ASSERT_EQ(regions.thickness_mm.size(), 2u);
  EXPECT_NEAR(regions.thickness_mm[0], 2 * signed_volume(mesh) / surface_area(mesh), 0.6);
  EXPECT_NEAR(regions.thickness_mm[1], 3, 0.5);  // its ends count, and its root
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const double z = mesh.vertices[mesh.faces[f][0]].z();
    if (z > 50) {
      EXPECT_EQ(regions.of_face[f], 1u) << z;
    }
    if (z < 20) {
      EXPECT_EQ(regions.of_face[f], 0u) << z;
    }
  }
}

TEST(ThicknessRegions, PiecesHaveTheirOwnAndSpecksNone) {
  const TriangleMesh two = joined(sphere_mesh(30, 4), moved(sphere_mesh(6, 3), {60, 0, 0}));
  const ThicknessRegions regions = thickness_regions(two);
  ASSERT_EQ(regions.thickness_mm.size(), 2u);
  EXPECT_NEAR(regions.thickness_mm[0], 20, 0.4);
  EXPECT_NEAR(regions.thickness_mm[1], 4, 0.2);
  const TriangleMesh speck = joined(sphere_mesh(30, 4), moved(sphere_mesh(0.01, 1), {60, 0, 0}));
  EXPECT_NEAR(only_thickness_mm(speck), 20, 0.2);
}

TEST(ThicknessRegions, ASheetWithABorderHasNone) {
  EXPECT_TRUE(thickness_regions(cut_in_half(sphere_mesh(30, 3), {0, 0, 1})).thickness_mm.empty());
  EXPECT_TRUE(thickness_regions({}).thickness_mm.empty());
}

TEST(ThicknessRegions, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = ball_with_stalk(30, 3, 60);
  const ThicknessRegions many = thickness_regions(mesh);
  const ThreadLimit one(1);
  const ThicknessRegions single = thickness_regions(mesh);
  EXPECT_EQ(many.thickness_mm, single.thickness_mm);
  EXPECT_EQ(many.of_face, single.of_face);
}

}  // namespace
}  // namespace organbake
