// SPDX-License-Identifier: GPL-3.0-or-later

#include <atomic>

#include "organbake/core/error.h"
#include "organbake/decimate/decimate.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/raycast/ray_scene.h"
#include "proxies.h"
#include "support/meshes.h"
#include "support/places.h"
#include "support/testing.h"

namespace organbake {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

DecimateOptions to_faces(std::size_t faces) {
  return {.method = DecimateMethod::lindstrom_turk, .faces = faces};
}

TEST(DecimateOptions, DefaultsAreValid) { EXPECT_NO_THROW(DecimateOptions{}.check()); }

TEST(DecimateOptions, FewerFacesThanATetrahedronAreRefused) {
  EXPECT_NO_THROW(to_faces(4).check());
  EXPECT_THROW(to_faces(3).check(), UsageError);
  EXPECT_THROW(decimate(tetrahedron_mesh(), to_faces(0)), UsageError);
}

TEST(Decimate, KeepsBudgetManifoldnessAndVolume) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const double diagonal = bounds(mesh).diagonal();
  for (const std::size_t faces : {4, 20, 80, 81, 300}) {
    const DecimateResult s = decimate(mesh, to_faces(faces));
    EXPECT_LE(s.proxy.faces.size(), faces);
    EXPECT_GE(s.proxy.faces.size() + 1, faces);  // collapses take two faces at a time
    EXPECT_TRUE(s.closed_manifold);
    EXPECT_EQ(analyse_topology(s.proxy).euler_characteristic, 2);
    // Volume is a constraint of each collapse; 1e-6 leaves room for thousands of solves.
    if (faces >= 20) {
      EXPECT_NEAR(s.volume_change, 0, 1e-6);
    }
    if (faces >= 80) {
      EXPECT_LT(s.rms_mm, 0.01 * diagonal);
    }
    EXPECT_LE(s.rms_mm, s.max_mm);
    EXPECT_LE(s.reverse_rms_mm, s.reverse_max_mm);
  }
}

TEST(Decimate, AFlatSidedBodyLosesNothing) {
  const DecimateResult s = decimate(grid_box({30, 20, 10}, 8), to_faces(12));
  EXPECT_EQ(s.proxy.faces.size(), 12u);
  EXPECT_NEAR(signed_volume(s.proxy), 6000, 1e-6);
  // Solves of 3×3 systems whose planes are exact: micrometres would already be a defect.
  EXPECT_LT(s.max_mm, 1e-6);
  EXPECT_LT(s.reverse_max_mm, 1e-6);
}

TEST(Decimate, AnOpenSurfaceKeepsItsBorder) {
  TriangleMesh cap;
  const TriangleMesh sphere = sphere_mesh(50, 4);
  cap.vertices = sphere.vertices;
  for (const Face& f : sphere.faces) {
    if (sphere.vertices[f[0]].z() > 0) cap.faces.push_back(f);
  }
  const DecimateResult s = decimate(cap, to_faces(100));
  EXPECT_LE(s.proxy.faces.size(), 100u);
  EXPECT_FALSE(s.closed_manifold);
  const MeshTopology topology = analyse_topology(s.proxy);
  EXPECT_EQ(topology.non_manifold_edges, 0u);
  EXPECT_GT(topology.boundary_edges, 0u);
  EXPECT_EQ(topology.euler_characteristic, 1);
  EXPECT_LT(s.rms_mm, 1.0);
}

TEST(Decimate, PlaceAndUnitDoNotMatter) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const DecimateResult here = decimate(mesh, to_faces(80));
  const DecimateResult there = decimate(moved(mesh, {1e6, -2e6, 3e6}), to_faces(80));
  // Input coordinates of 3e6 are rounded to 5e-10 mm; collapses in another order would show as mm.
  EXPECT_NEAR(here.rms_mm, there.rms_mm, 1e-4);
  const DecimateResult metres = decimate(scaled(mesh, 1e-3), to_faces(80));
  EXPECT_NEAR(here.rms_mm, 1e3 * metres.rms_mm, 1e-4);
}

TEST(Decimate, IsRepeatable) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const DecimateResult a = decimate(mesh, to_faces(80)), b = decimate(mesh, to_faces(80));
  EXPECT_EQ(a.proxy.vertices, b.proxy.vertices);
  EXPECT_EQ(a.proxy.faces, b.proxy.faces);
  EXPECT_EQ(a.rms_mm, b.rms_mm);
}

TEST(Decimate, EdgesWithoutLengthAreNoObstacle) {
  TriangleMesh mesh = lumpy_mesh(50, 3);
  for (std::size_t f = 0; f < 40; ++f) {
    mesh.vertices[mesh.faces[f * 20][0]] = mesh.vertices[mesh.faces[f * 20][1]];
  }
  ASSERT_GT(analyse_topology(mesh).degenerate_faces, 0u);
  const DecimateResult s = decimate(mesh, to_faces(80));
  EXPECT_EQ(s.proxy.faces.size(), 80u);
  EXPECT_TRUE(s.closed_manifold);
}

TEST(Decimate, ASurfaceWithinTheBudgetIsReturned) {
  const DecimateResult s = decimate(tetrahedron_mesh(), to_faces(80));
  EXPECT_EQ(s.proxy.faces.size(), 4u);
  EXPECT_LT(s.max_mm, 1e-12);
  EXPECT_EQ(s.volume_change, 0);
}

TEST(Decimate, ABudgetBelowTheTopologyNamesTheReachedCount) {
  const TriangleMesh two = joined(sphere_mesh(10, 2), moved(sphere_mesh(10, 2), {50, 0, 0}));
  EXPECT_EQ(decimate(two, to_faces(8)).proxy.faces.size(), 8u);
  EXPECT_THAT([&] { decimate(two, to_faces(7)); },
              ThrowsMessage<BadDataError>(HasSubstr("below 8 faces")));
}

TEST(Decimate, UnusableSurfacesAreRefused) {
  EXPECT_THROW(decimate({}, to_faces(80)), BadDataError);
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.faces[0][0] = 77;
  EXPECT_THROW(decimate(mesh, to_faces(80)), BadDataError);
  mesh = tetrahedron_mesh();
  mesh.vertices[0].x() = std::nan("");
  EXPECT_THROW(decimate(mesh, to_faces(80)), BadDataError);
  mesh = tetrahedron_mesh();
  for (Eigen::Vector3d& v : mesh.vertices) v.setOnes();
  EXPECT_THROW(decimate(mesh, to_faces(80)), BadDataError);
}

TEST(Decimate, CanBeCancelled) {
  std::atomic<bool> cancel{true};
  const RunContext context({}, {}, &cancel);
  EXPECT_THROW(decimate(lumpy_mesh(50, 4), to_faces(80), context), CancelledError);
}

TEST(Decimate, RealLiverAndItsVessels) {
  const std::filesystem::path folder = shared_data("mesh/liver");
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no real meshes at " << folder << ": real-data decimation is NOT tested";
  }
  for (const char* name :
       {"liver.vtk", "gallbladder.vtk", "portal_vein.vtk", "liver_tumours.vtk"}) {
    SCOPED_TRACE(name);
    const TriangleMesh mesh = read_mesh(folder / name);
    const DecimateResult s = decimate(mesh, to_faces(400));
    EXPECT_LE(s.proxy.faces.size(), 400u);
    EXPECT_EQ(s.closed_manifold, analyse_topology(mesh).boundary_edges == 0);
    EXPECT_LT(s.rms_mm, 0.01 * bounds(mesh).diagonal());
    EXPECT_LT(std::abs(s.volume_change), 0.01);
  }
}

// All collapses cost nothing there, and no distance is a bound: that took minutes, and more than
// the square of the faces.
TEST(Decimate, FlatSurfacesTakeNoLonger) {
  constexpr std::uint32_t kSide = 100;
  TriangleMesh flat;
  for (std::uint32_t i = 0; i <= kSide; ++i)
    for (std::uint32_t j = 0; j <= kSide; ++j) flat.vertices.emplace_back(0.6 * i, 0.6 * j, 5);
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j) {
      const std::uint32_t a = i * (kSide + 1) + j, b = a + kSide + 1;
      flat.faces.push_back({a, b, b + 1});
      flat.faces.push_back({a, b + 1, a + 1});
    }
  }
  const DecimateResult result = decimate(flat, {.faces = 200});
  EXPECT_LE(result.proxy.faces.size(), 200u);
  EXPECT_EQ(result.boundary_loops, 1u);
  EXPECT_NEAR(surface_area(result.proxy), 3600, 1e-6 * 3600);
  EXPECT_LT(std::max(result.max_mm, result.reverse_max_mm), 1e-4);
}

TEST(FacesForTool, GiveEdgesOfThreeRadii) {
  const TriangleMesh surface = sphere_mesh(60, 5);
  for (const double radius_mm : {4.0, 7.0}) {
    DecimateOptions options;
    options.faces = faces_for_tool(surface, radius_mm);
    constexpr double kNearly = 0.1;  // faces are not all equilateral
    EXPECT_NEAR(mean_edge_length(decimate(surface, options).proxy) / (3 * radius_mm), 1, kNearly);
  }
}

TEST(FacesForTool, AreNeitherFewerThanThePapersNorMoreThanAFrameBears) {
  EXPECT_EQ(faces_for_tool(sphere_mesh(10, 4), 50), 80u);
  EXPECT_EQ(faces_for_tool(sphere_mesh(300, 4), 1), 1500u);
}

TEST(FacesForTool, NeedAToolOfSomeSize) {
  const TriangleMesh surface = sphere_mesh(40, 3);
  for (const double radius_mm : {0.0, -5.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(faces_for_tool(surface, radius_mm), UsageError);
}

constexpr double kShare = 0.1;

// By brute force: the surface's vertices above z, and points of the proxy above it.
double farthest_above_mm(const TriangleMesh& surface, const TriangleMesh& proxy, double z_mm) {
  const RayScene to_proxy(proxy), to_surface(surface);
  double far_mm = 0;
  for (const Eigen::Vector3d& v : surface.vertices)
    if (v.z() > z_mm) far_mm = std::max(far_mm, to_proxy.closest_point(v).distance_mm);
  for (const Face& f : proxy.faces) {
    const Eigen::Vector3d middle =
        (proxy.vertices[f[0]] + proxy.vertices[f[1]] + proxy.vertices[f[2]]) / 3;
    if (middle.z() > z_mm) far_mm = std::max(far_mm, to_surface.closest_point(middle).distance_mm);
  }
  return far_mm;
}

TEST(ServingProxy, FollowsAThinVesselByTheVesselsMeasure) {
  const TriangleMesh mesh = ball_with_stalk(30, 3, 45);
  const DecimateResult few = decimate(mesh, {.faces = 80});
  EXPECT_GT(few.worst_share, kShare);
  const DecimateResult s = decimate(mesh, {.faces = 80, .max_share = kShare});
  EXPECT_LE(s.worst_share, kShare);
  EXPECT_GT(s.proxy.faces.size(), 80u);
  EXPECT_TRUE(s.closed_manifold);
  EXPECT_EQ(analyse_topology(s.proxy).euler_characteristic, 2);
  // The stalk's thickness is its radius, a little more near its root.
  EXPECT_LE(farthest_above_mm(mesh, s.proxy, 45), kShare * 3.5);
  EXPECT_LE(std::max(s.max_mm, s.reverse_max_mm), kShare * 20);
}

TEST(ServingProxy, KeepsARingsShape) {
  const TriangleMesh ring = torus_mesh(40, 3, 120, 24);
  const DecimateResult s = decimate(ring, {.faces = 80, .max_share = kShare});
  EXPECT_LE(std::max(s.max_mm, s.reverse_max_mm), 1.03 * kShare * 3);  // thickness by chords
  EXPECT_EQ(s.genus, 1);
}

TEST(ServingProxy, LeavesAloneWhatServes) {
  const TriangleMesh ball = sphere_mesh(30, 5);
  const DecimateResult plain = decimate(ball, {.faces = 300});
  ASSERT_LE(plain.worst_share, kShare);
  const DecimateResult s = decimate(ball, {.faces = 300, .max_share = kShare});
  EXPECT_EQ(s.proxy.faces, plain.proxy.faces);
  EXPECT_EQ(s.proxy.vertices, plain.proxy.vertices);
}

TEST(ServingProxy, EndsAtItsMostFacesAndSaysHowFarItIs) {
  const TriangleMesh ring = torus_mesh(40, 3, 120, 24);
  const DecimateResult s = decimate(ring, {.faces = 60, .max_share = kShare, .most_faces = 100});
  EXPECT_LE(s.proxy.faces.size(), 100u);
  EXPECT_GT(s.worst_share, kShare);
  EXPECT_NEAR(s.worst_thickness_mm, 3, 0.1);
  EXPECT_NEAR(s.worst_mm, std::max(s.max_mm, s.reverse_max_mm), 1e-9);
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

}  // namespace
}  // namespace organbake
