// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/mesh_measures.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/raycast/ray_scene.h"
#include "proxies.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr std::size_t kSamples = 20'000;
constexpr double kRounding = 1e-12;  // double arithmetic on coordinates of about 10 mm

TEST(MeshDistance, OfAMeshToItselfIsZero) {
  const TriangleMesh mesh = lumpy_mesh(10, 3);
  const MeshDistance d = mesh_distance(mesh, RayScene(mesh), kSamples, 1);
  EXPECT_LT(d.max_mm, kRounding);
}

TEST(MeshDistance, BetweenParallelSquaresIsTheirGap) {
  TriangleMesh low;
  low.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}};
  low.faces = {{0, 1, 2}, {0, 2, 3}};
  const MeshDistance d = mesh_distance(low, RayScene(moved(low, {0, 0, 3})), kSamples, 1);
  EXPECT_NEAR(d.mean_mm, 3, kRounding);
  EXPECT_NEAR(d.rms_mm, 3, kRounding);
  EXPECT_NEAR(d.max_mm, 3, kRounding);
}

// A unit square against its lower edge: distance = y, uniform in 0…1.
TEST(MeshDistance, SamplesAreUniformByArea) {
  TriangleMesh square;
  square.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.3, 0}};
  // A fan about an inner point: faces of very different size.
  square.faces = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  TriangleMesh edge;
  edge.vertices = {{-9, 0, 0}, {10, 0, 0}, {0, -9, 0}};
  edge.faces = {{0, 1, 2}};
  const MeshDistance d = mesh_distance(square, RayScene(edge), kSamples, 1);
  const double standard_error = std::sqrt(1.0 / 12 / kSamples);  // of an unstratified mean
  EXPECT_NEAR(d.mean_mm, 0.5, 3 * standard_error);
  EXPECT_NEAR(d.rms_mm, std::sqrt(1.0 / 3), 3 * standard_error);
  EXPECT_GT(d.max_mm, 0.99);
}

TEST(MeshDistance, FromAnInscribedToACircumscribedSphere) {
  const TriangleMesh fine = sphere_mesh(50, 5);
  // Chords of a level-5 icosphere lie up to 0.03 mm below the sphere.
  constexpr double kChord = 0.03;
  const MeshDistance d = mesh_distance(fine, RayScene(sphere_mesh(52, 5)), kSamples, 1);
  EXPECT_NEAR(d.mean_mm, 2, kChord);
  EXPECT_NEAR(d.max_mm, 2, 2 * kChord);
}

TEST(MeshDistance, IsTheSameForAnyNumberOfThreadsAndNotForAnySeed) {
  const TriangleMesh a = lumpy_mesh(10, 3);
  const RayScene b(sphere_mesh(10, 2));
  const MeshDistance many = mesh_distance(a, b, 5001, 3);
  const ThreadLimit one(1);
  const MeshDistance single = mesh_distance(a, b, 5001, 3);
  EXPECT_EQ(many.rms_mm, single.rms_mm);
  EXPECT_EQ(many.mean_mm, single.mean_mm);
  EXPECT_EQ(many.max_mm, single.max_mm);
  EXPECT_NE(many.rms_mm, mesh_distance(a, b, 5001, 4).rms_mm);
}

// Brute force: all vertices and a million samples.
TEST(LargestDistance, IsNeverBelowBruteForceAndWithinOnePercent) {
  const TriangleMesh fine = lumpy_mesh(50, 5), coarse = lumpy_mesh(50, 1);
  for (const auto& [from, to] : {std::pair(&fine, &coarse), std::pair(&coarse, &fine)}) {
    const RayScene scene(*to);
    double brute_mm = mesh_distance(*from, scene, 1'000'000, 7).max_mm;
    for (const auto& v : from->vertices)
      brute_mm = std::max(brute_mm, scene.closest_point(v).distance_mm);
    const double found_mm = largest_distance(*from, *to, scene);
    EXPECT_GE(found_mm, brute_mm);
    EXPECT_LE(found_mm, 1.01 * brute_mm);
  }
}

TEST(LargestDistance, OfGroupsIsThatOfTheirFacesAlone) {
  const TriangleMesh fine = lumpy_mesh(50, 4), coarse = lumpy_mesh(50, 1);
  const RayScene scene(coarse);
  std::vector<std::uint32_t> group(fine.faces.size());
  TriangleMesh parts[2] = {fine, fine};
  parts[0].faces.clear(), parts[1].faces.clear();
  for (std::uint32_t f = 0; f < fine.faces.size(); ++f) {
    group[f] = fine.vertices[fine.faces[f][0]].z() > 20;
    parts[group[f]].faces.push_back(fine.faces[f]);
  }
  const std::vector<double> found_mm = largest_distances(fine, {group, 3}, coarse, scene);
  for (int g = 0; g < 2; ++g)
    EXPECT_NEAR(found_mm[g], largest_distance(parts[g], coarse, scene), 1e-3 * found_mm[g]);
  EXPECT_EQ(found_mm[2], 0);
}

TEST(MeshDistance, UnusableMeshesAreRefused) {
  const TriangleMesh good = tetrahedron_mesh();
  EXPECT_THROW(mesh_distance({}, RayScene(good), 10, 1), BadDataError);
  EXPECT_THROW(mesh_distance(good, RayScene(TriangleMesh()), 10, 1), BadDataError);
  TriangleMesh flat = good;
  flat.faces = {{0, 0, 1}};
  EXPECT_THROW(mesh_distance(flat, RayScene(good), 10, 1), BadDataError);
}

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

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(ManifoldFaces, TurnAnInwardSurface) {
  TriangleMesh mesh = lumpy_mesh(10, 2);
  const double volume = signed_volume(mesh);
  for (Face& face : mesh.faces) std::swap(face[0], face[1]);
  // Volumes are sums of about 300 products: a few hundred roundings.
  EXPECT_NEAR(signed_volume(manifold_faces(mesh)) / volume, 1, 1e-13);
}

// A cavity's scan is hollow towards the viewer: seen from the origin, its "volume" is negative.
TEST(ManifoldFaces, KeepAnOpenSurfaceAsItIsWound) {
  TriangleMesh cavity = lumpy_mesh(10, 2);
  std::erase_if(cavity.faces, [&](const Face& f) { return cavity.vertices[f[0]].z() > 3; });
  for (Face& face : cavity.faces) std::swap(face[0], face[1]);
  ASSERT_LT(signed_volume(cavity), 0);
  EXPECT_EQ(face_normal(manifold_faces(cavity), 0), face_normal(cavity, 0));
}

TEST(ManifoldFaces, DropFacesWithARepeatedCornerAndUnusedVertices) {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.faces.push_back({1, 1, 2});
  mesh.faces.push_back({3, 3, 3});
  mesh.vertices.push_back({9, 9, 9});
  const TriangleMesh kept = manifold_faces(mesh);
  EXPECT_EQ(kept.faces.size(), 4u);
  EXPECT_EQ(kept.vertices.size(), 4u);
}

TEST(ManifoldFaces, SplitAVertexWhereTwoBodiesTouch) {
  TriangleMesh mesh = joined(tetrahedron_mesh(), scaled(tetrahedron_mesh(), -1));
  for (std::size_t f = 4; f < 8; ++f) std::swap(mesh.faces[f][0], mesh.faces[f][1]);
  for (Face& face : mesh.faces) {
    for (std::uint32_t& v : face) v = v == 4 ? 0 : v;  // both bodies use vertex 0
  }
  ASSERT_EQ(analyse_topology(mesh).non_manifold_vertices, 1u);
  const TriangleMesh kept = manifold_faces(mesh);
  EXPECT_TRUE(analyse_topology(kept).closed_manifold());
  EXPECT_EQ(kept.vertices.size(), 8u);
}

TEST(ManifoldFaces, RefuseWhatHasNoUniqueRepair) {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.vertices.push_back({1, 1, 1});
  mesh.faces.push_back({0, 1, 4});
  EXPECT_THAT([&] { manifold_faces(mesh); },
              ThrowsMessage<BadDataError>(HasSubstr("1 edges belong to three or more faces")));
  mesh = tetrahedron_mesh();
  std::swap(mesh.faces[1][0], mesh.faces[1][1]);
  EXPECT_THAT([&] { manifold_faces(mesh); },
              ThrowsMessage<BadDataError>(HasSubstr("wound against each other at 3 edges")));
  mesh.faces = {{0, 0, 1}};
  EXPECT_THAT([&] { manifold_faces(mesh); }, ThrowsMessage<BadDataError>(HasSubstr("no faces")));
}

}  // namespace
}  // namespace organbake
