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
  const KeptComponents kept = keep_components(ball_with_cavity_and_crumb(), {.largest = 1});
  EXPECT_EQ(kept.found, 2u);
  EXPECT_EQ(kept.kept, 1u);
  EXPECT_NEAR(bounds(kept.mesh).max.x() - kFar.x(), 10, 0.5);
  EXPECT_EQ(analyse_topology(kept.mesh).components, 1u);
  EXPECT_TRUE(analyse_topology(kept.mesh).closed_manifold());
  EXPECT_EQ(analyse_topology(kept.mesh).unused_vertices, 0u);
}

TEST(SurfaceComponents, FilledCavitiesGoUnlessAllIsKept) {
  const auto walls = [](std::size_t largest) {
    const TriangleMesh all = ball_with_cavity_and_crumb();
    return analyse_topology(keep_components(all, {.largest = largest}).mesh).components;
  };
  EXPECT_EQ(walls(3), 2u);  // ball and crumb
  EXPECT_EQ(walls(0), 3u);
}

TEST(SurfaceComponents, GapsOfALabelAreFilled) {
  const TriangleMesh holed = joined(sphere_mesh(10, 3), inside_out(sphere_mesh(1.5, 2)));
  const auto walls = [&](std::size_t largest) {
    const ComponentFilter filter{.largest = largest, .cavities = Cavities::kept};
    return analyse_topology(keep_components(holed, filter).mesh).components;
  };
  EXPECT_EQ(walls(1), 1u);
  EXPECT_EQ(walls(0), 2u);
}

TEST(SurfaceComponents, OfOpenSurfacesAllPiecesCount) {
  const ComponentFilter open{.largest = 2, .cavities = Cavities::none};
  EXPECT_EQ(keep_components(ball_with_cavity_and_crumb(), open).kept, 2u);
  EXPECT_EQ(keep_components(ball_with_cavity_and_crumb(), open).found, 3u);
}

// A ball with a cavity, in whose box, but not in whose wall, a second and smaller one lies.
TEST(SurfaceComponents, CavitiesStayWithThePieceThatTheyLieIn) {
  const TriangleMesh large = joined(sphere_mesh(10, 3), inside_out(sphere_mesh(8, 3)));
  const TriangleMesh small = joined(sphere_mesh(2, 3), inside_out(sphere_mesh(1, 3)));
  const auto volume = [&](const Eigen::Vector3d& place) {
    const TriangleMesh both = moved(joined(moved(small, place), large), kFar);
    const KeptComponents kept = keep_components(both, {.largest = 1, .cavities = Cavities::kept});
    EXPECT_EQ(kept.found, 2u);
    EXPECT_NEAR(kept.left_out_share, signed_volume(small) / signed_volume(both), 1e-9);
    return signed_volume(kept.mesh);
  };
  EXPECT_NEAR(volume({7.5, 7.5, 7.5}), signed_volume(large), 1e-6);  // in a corner of its box
  EXPECT_NEAR(volume({0, 0, 0}), signed_volume(large), 1e-6);        // in its cavity
}

TEST(SurfaceComponents, ASingleInwardPieceIsKept) {
  const TriangleMesh mesh = moved(inside_out(joined(sphere_mesh(8, 2), sphere_mesh(2, 2))), kFar);
  EXPECT_EQ(keep_components(mesh, {.largest = 1}).kept, 1u);
}

TEST(SurfaceComponents, SmallPiecesGo) {
  const auto kept = [](double min_size_mm) {
    return keep_components(ball_with_cavity_and_crumb(),
                           {.largest = 0, .min_size_mm = min_size_mm});
  };
  EXPECT_EQ(kept(1).kept, 2u);
  EXPECT_EQ(kept(3).kept, 1u);  // the crumb of 2 mm goes
  EXPECT_EQ(analyse_topology(kept(3).mesh).components, 2u);
  EXPECT_EQ(analyse_topology(kept(17).mesh).components, 1u);  // and its cavity
  EXPECT_TRUE(kept(30).mesh.empty());
  EXPECT_EQ(analyse_topology(kept(17).mesh).unused_vertices, 0u);
  EXPECT_NEAR(bounds(kept(17).mesh).max.x() - kFar.x(), 10, 0.5);
}

TEST(SurfaceComponents, AnEmptyMeshStaysEmpty) {
  EXPECT_EQ(keep_components({}, {.largest = 1}).found, 0u);
}

}  // namespace
}  // namespace organbake
