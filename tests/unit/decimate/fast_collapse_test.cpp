// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/fast_collapse.h"

#include <gtest/gtest.h>

#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"
#include "unit/decimate/seeded_meshes.h"

namespace organbake {
namespace {

TEST(FastCollapse, ReachesTheCountAndStaysManifold) {
  const TriangleMesh mesh = lumpy_mesh(50, 5);  // 20,480 faces
  for (const std::size_t faces : {200, 2000, 10'000}) {
    const TriangleMesh thin = fast_collapse(mesh, faces);
    EXPECT_LE(thin.faces.size(), faces);
    EXPECT_GE(thin.faces.size(), faces - 2);
    EXPECT_TRUE(analyse_topology(thin).closed_manifold());
    EXPECT_EQ(analyse_topology(thin).unused_vertices, 0u);
    EXPECT_NEAR(signed_volume(thin) / signed_volume(mesh), 1, 0.03);
  }
}

TEST(FastCollapse, KeepsGenusAndStopsAtTheTopology) {
  const TriangleMesh mesh = perforated_plate(3, 5, 4);
  const TriangleMesh thin = fast_collapse(mesh, 4);  // far too few
  EXPECT_EQ(analyse_topology(thin).euler_characteristic, -4);
  EXPECT_TRUE(analyse_topology(thin).closed_manifold());
}

TEST(FastCollapse, LeavesTheBorderWhereItIs) {
  const TriangleMesh mesh = opened(lumpy_mesh(50, 4), 1);
  const TriangleMesh thin = fast_collapse(mesh, 500);
  EXPECT_LT(thin.faces.size(), 700u);
  EXPECT_EQ(analyse_topology(thin).boundary_edges, analyse_topology(mesh).boundary_edges);
}

}  // namespace
}  // namespace organbake
