// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/mesh_defects.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/mesh_checks.h"
#include "split_hubs.h"
#include "support/meshes.h"

namespace organbake {
namespace {

TEST(SelfIntersections, AreFoundWhereBodiesCrossAndNowhereElse) {
  const TriangleMesh ball = sphere_mesh(10, 2);
  EXPECT_TRUE(self_intersecting_faces(ball).empty());
  EXPECT_TRUE(self_intersecting_faces(grid_box({30, 20, 10}, 4)).empty());
  EXPECT_TRUE(self_intersecting_faces(joined(ball, moved(ball, {21, 0, 0}))).empty());
  const auto crossing = self_intersecting_faces(joined(ball, moved(ball, {15, 3, 1})));
  EXPECT_GT(crossing.size(), 10u);
  EXPECT_LT(crossing.size(), ball.faces.size());
  // A vertex pulled through the far side.
  TriangleMesh pulled = ball;
  pulled.vertices[0] *= -1.5;
  EXPECT_FALSE(self_intersecting_faces(pulled).empty());
}

// Pairs of such faces are the square of their number.
TEST(SelfIntersections, AreGivenUpInAHeap) {
  TriangleMesh heap = tetrahedron_mesh();
  heap.faces.assign(100'000, heap.faces.front());
  EXPECT_TRUE(self_intersections(heap).complete) << "all of them are";
  EXPECT_EQ(self_intersections(heap).faces.size(), heap.faces.size());
  EXPECT_FALSE(self_intersections(cone_mesh(30'000)).complete);
  EXPECT_TRUE(self_intersections(cone_mesh(3'000)).complete);
  EXPECT_TRUE(self_intersecting_faces(cone_mesh(3'000)).empty());
}

TEST(SplitHubs, ConesAreArrangedOtherwise) {
  TriangleMesh cone = cone_mesh(16'000);
  const double area = surface_area(cone), volume = signed_volume(cone);
  const std::size_t faces = cone.faces.size();
  split_hubs(cone);
  EXPECT_EQ(cone.faces.size(), faces);
  EXPECT_TRUE(analyse_topology(cone).closed_manifold());
  // Its rim is cut by chords of 1/128 of a turn, at most.
  EXPECT_NEAR(surface_area(cone), area, 1e-3 * area);
  EXPECT_NEAR(signed_volume(cone), volume, 1e-3 * volume);
  const VertexFaces around(cone.faces, cone.vertices.size());
  for (std::uint32_t v = 0; v < cone.vertices.size(); ++v) EXPECT_LE(around.of(v).size(), 128u);
}

TEST(SplitHubs, OtherMeshesStayAsTheyAre) {
  TriangleMesh ball = sphere_mesh(10, 4);
  const std::vector<Face> faces = ball.faces;
  split_hubs(ball);
  EXPECT_EQ(ball.faces, faces);
}

// Wound many times round: nothing can be cut off it, and to collapse its edges would take days.
TEST(SplitHubs, RefuseWhatStaysOne) {
  TriangleMesh screw;
  screw.vertices.emplace_back(0, 0, 0);
  for (std::uint32_t i = 0; i < 20'000; ++i)
    screw.vertices.emplace_back(std::cos(2.0 * i), std::sin(2.0 * i), 1e-5 * i);
  for (std::uint32_t i = 1; i + 1 < screw.vertices.size(); ++i)
    screw.faces.push_back({0, i, i + 1});
  EXPECT_THROW(split_hubs(screw), BadDataError);
}

}  // namespace
}  // namespace organbake
