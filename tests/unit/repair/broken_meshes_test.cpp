// SPDX-License-Identifier: GPL-3.0-or-later
#include "broken_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_distance.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/polygon.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/repair/repair.h"

namespace organbake {
namespace {

// The targets where no wrap is needed: volume within 1 %, no point farther off than 0.5 mm.
constexpr double kVolumeShare = 0.01, kDistance_mm = 0.5;
// A wrap sags into what it closes, and rounds edges by some of the size that it closes.
constexpr double kWrapVolumeShare = 0.05;

class BrokenMeshes : public testing::TestWithParam<std::size_t> {};

TEST_P(BrokenMeshes, BecomeUsableOrgans) {
  const BrokenMesh broken = broken_meshes()[GetParam()];
  SCOPED_TRACE(broken.name);
  // As a bake does it: read_mesh welds, repair mends, decimate makes the proxy.
  TriangleMesh welded = broken.mesh;
  weld(welded);
  const RepairSummary repaired = repair(welded, {});
  const MeshTopology topology = analyse_topology(repaired.mesh);
  EXPECT_EQ(topology.non_manifold_edges, 0u);
  EXPECT_EQ(topology.non_manifold_vertices, 0u);
  EXPECT_EQ(topology.misoriented_edges, 0u);
  EXPECT_EQ(topology.closed_manifold(), !broken.open);
  EXPECT_EQ(repaired.wrapped, broken.needs_wrap);
  for (const std::string& done : repaired.done) std::cout << broken.name << ": " << done << "\n";

  if (!broken.open) {
    const double share = signed_volume(repaired.mesh) / signed_volume(broken.meant) - 1;
    EXPECT_LT(std::abs(share), broken.needs_wrap ? kWrapVolumeShare : kVolumeShare);
  }
  if (!broken.needs_wrap) {
    EXPECT_LT(largest_distance(broken.meant, repaired.mesh, RayScene(repaired.mesh)), kDistance_mm);
    EXPECT_LT(largest_distance(repaired.mesh, broken.meant, RayScene(broken.meant)), kDistance_mm);
  }
  const DecimateResult proxy = decimate(
      repaired.mesh, {.method = DecimateMethod::quadric, .faces = broken.open ? 200u : 400u});
  EXPECT_GT(proxy.proxy.faces.size(), 20u);
  EXPECT_EQ(proxy.closed_manifold, !broken.open);
}

INSTANTIATE_TEST_SUITE_P(All, BrokenMeshes, testing::Range(std::size_t{0}, broken_meshes().size()));

}  // namespace
}  // namespace organbake
