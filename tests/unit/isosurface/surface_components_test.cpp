// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface_components.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// Far from the origin, where sums of signed volumes lose their digits.
const Eigen::Vector3d kFar(1000, -2000, 1500);

TriangleMesh ball_with_cavity_and_crumb() {
  const TriangleMesh crumb = moved(sphere_mesh(1, 1), {30, 0, 0});
  return moved(joined(joined(crumb, inside_out(sphere_mesh(8, 2))), sphere_mesh(10, 2)), kFar);
}

TEST(SurfaceComponents, TheLargestOutwardPieceIsTheOrgan) {
  const KeptComponents kept =
      keep_components(ball_with_cavity_and_crumb(), {.largest = 1, .outward_only = true});
  EXPECT_EQ(kept.found, 3u);
  EXPECT_EQ(kept.kept, 1u);
  EXPECT_NEAR(bounds(kept.mesh).max.x() - kFar.x(), 10, 0.5);
  EXPECT_TRUE(analyse_topology(kept.mesh).closed_manifold());
  EXPECT_EQ(analyse_topology(kept.mesh).unused_vertices, 0u);
}

TEST(SurfaceComponents, CavitiesGoWhenPiecesAreCounted) {
  const KeptComponents kept =
      keep_components(ball_with_cavity_and_crumb(), {.largest = 3, .outward_only = true});
  EXPECT_EQ(kept.kept, 2u);  // ball and crumb
}

TEST(SurfaceComponents, AllMeansAll) {
  EXPECT_EQ(
      keep_components(ball_with_cavity_and_crumb(), {.largest = 0, .outward_only = true}).kept, 3u);
  EXPECT_EQ(
      keep_components(ball_with_cavity_and_crumb(), {.largest = 2, .outward_only = false}).kept,
      2u);
}

TEST(SurfaceComponents, ASingleInwardPieceIsKept) {
  const TriangleMesh mesh = moved(inside_out(joined(sphere_mesh(8, 2), sphere_mesh(2, 2))), kFar);
  EXPECT_EQ(keep_components(mesh, {.largest = 1, .outward_only = true}).kept, 1u);
}

TEST(SurfaceComponents, SmallPiecesGo) {
  const auto kept = [](double min_size_mm) {
    return keep_components(ball_with_cavity_and_crumb(),
                           {.largest = 0, .min_size_mm = min_size_mm});
  };
  EXPECT_EQ(kept(1).kept, 3u);
  EXPECT_EQ(kept(3).kept, 2u);  // the crumb of 2 mm
  EXPECT_EQ(kept(17).kept, 1u);
  EXPECT_TRUE(kept(30).mesh.empty());
  EXPECT_EQ(analyse_topology(kept(17).mesh).unused_vertices, 0u);
  EXPECT_NEAR(bounds(kept(17).mesh).max.x() - kFar.x(), 10, 0.5);
}

TEST(SurfaceComponents, AnEmptyMeshStaysEmpty) {
  EXPECT_EQ(keep_components({}, {.largest = 1, .outward_only = true}).found, 0u);
}

}  // namespace
}  // namespace organbake
