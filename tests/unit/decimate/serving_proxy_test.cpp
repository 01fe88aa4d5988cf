// SPDX-License-Identifier: GPL-3.0-or-later
#include "serving_proxy.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/decimate/mesh_distance.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/raycast/ray_scene.h"
#include "support/meshes.h"

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
