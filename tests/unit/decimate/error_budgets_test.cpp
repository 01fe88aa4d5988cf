// SPDX-License-Identifier: GPL-3.0-or-later
#include "proxies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/raycast/ray_scene.h"
#include "support/meshes.h"
#include "unit/decimate/seeded_meshes.h"

namespace organbake {
namespace {

// A surface with a border, the hardest kind; all fifty take minutes.
TEST(MaxError, IsKeptWithFewFaces) {
  for (const std::uint64_t seed : {29}) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = manifold_faces(seeded_mesh(seed));
    DecimateOptions options{.max_error_mm = 0.02 * bounds(mesh).diagonal()};
    const DecimateResult s = decimate(mesh, options);
    EXPECT_LE(std::max(s.max_mm, s.reverse_max_mm), options.max_error_mm);
    const MeshTopology before = analyse_topology(mesh), after = analyse_topology(s.proxy);
    EXPECT_EQ(after.non_manifold_edges + after.non_manifold_vertices, 0u);
    EXPECT_EQ(after.components, before.components);
    EXPECT_EQ(after.euler_characteristic, before.euler_characteristic);
    options.method = DecimateMethod::lindstrom_turk;
    const DecimateResult plain = decimate(mesh, options);
    EXPECT_LE(plain.max_mm, options.max_error_mm);
    EXPECT_LE(double(s.proxy.faces.size()), 1.5 * double(plain.proxy.faces.size()));
  }
}

TEST(MaxError, BelowAnyDetailReturnsTheSurface) {
  const TriangleMesh mesh = lumpy_mesh(50, 0);
  const DecimateResult s = decimate(mesh, {.max_error_mm = 1e-9});
  EXPECT_EQ(s.proxy.faces.size(), mesh.faces.size());
  EXPECT_LT(s.max_mm, 1e-9);
}

TEST(MaxError, OptionsThatMakeNoSenseAreRefused) {
  EXPECT_THROW(DecimateOptions{.max_error_mm = -1}.check(), UsageError);
  EXPECT_THROW(DecimateOptions{.max_error_mm = std::nan("")}.check(), UsageError);
  EXPECT_THROW((DecimateOptions{.method = DecimateMethod::cluster, .max_error_mm = 1}.check()),
               UsageError);
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
