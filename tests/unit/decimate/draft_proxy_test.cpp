// SPDX-License-Identifier: GPL-3.0-or-later
#include "proxies.h"

#include <gtest/gtest.h>

#include <set>

#include "organbake/core/error.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"
#include "unit/decimate/seeded_meshes.h"

namespace organbake {
namespace {

TEST(DraftProxy, IsAManifoldNearTheSurface) {
  const TriangleMesh mesh = lumpy_mesh(50, 5);  // 20,480 faces, more than the clusters leave
  const DecimateResult draft = decimate(mesh, {.method = DecimateMethod::draft, .faces = 80});
  EXPECT_LE(draft.proxy.faces.size(), 80u);
  EXPECT_GE(draft.proxy.faces.size(), 78u);
  EXPECT_TRUE(draft.closed_manifold);
  EXPECT_EQ(draft.genus, 0);
  EXPECT_EQ(draft.worst_thickness_mm, 0);  // not asked for
  // What is promised: 0.7 % of the diagonal.
  EXPECT_LT(draft.rms_mm, 0.007 * bounds(mesh).diagonal());
}

// Clusters would make one plate of two: the collapses begin with the surface.
TEST(DraftProxy, KeepsWhatIsThinnerThanItsClusters) {
  const TriangleMesh plate = grid_box({200, 200, 0.5}, 60);  // 43,200 faces
  const TriangleMesh proxy = draft_proxy(plate, 100);
  EXPECT_TRUE(analyse_topology(proxy).closed_manifold());
  EXPECT_NEAR(signed_volume(proxy), signed_volume(plate), 0.05 * signed_volume(plate));
}

TEST(DraftProxy, CannotKeepAnErrorBudget) {
  EXPECT_THROW(DecimateOptions({.method = DecimateMethod::draft, .max_error_mm = 1}).check(),
               UsageError);
}

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

TEST(VertexClustering, KeepsTheBudgetAndComesNearIt) {
  const TriangleMesh mesh = lumpy_mesh(50, 4);
  for (const std::size_t budget : {4, 20, 80, 500, 2000}) {
    const TriangleMesh proxy = cluster_vertices(mesh, budget);
    EXPECT_LE(proxy.faces.size(), budget);
    EXPECT_GE(proxy.faces.size(), budget / 2);
  }
}

TEST(VertexClustering, LeavesOnlyFacesThatCanBeUsed) {
  const TriangleMesh proxy = cluster_vertices(lumpy_mesh(50, 4), 200);
  const MeshTopology topology = analyse_topology(proxy);
  EXPECT_EQ(topology.degenerate_faces, 0u);
  EXPECT_EQ(topology.unused_vertices, 0u);
  std::set<std::set<std::uint32_t>> corners;
  for (const Face& face : proxy.faces) corners.insert({face.begin(), face.end()});
  EXPECT_EQ(corners.size(), proxy.faces.size());
}

TEST(VertexClustering, FacesStayOutward) {
  // Clusters shrink a convex body a little (their means lie inside), never turn it.
  const double volume = signed_volume(cluster_vertices(sphere_mesh(50, 5), 200));
  const double sphere = 4.0 / 3 * 3.14159265 * 50 * 50 * 50;
  EXPECT_GT(volume, 0.6 * sphere);
  EXPECT_LT(volume, sphere);
}

TEST(VertexClustering, ALargeOffsetChangesNothing) {
  // Powers of two, so that moving rounds nothing and the grid stays where it is.
  const TriangleMesh mesh = grid_box({64, 64, 64}, 16);
  const Eigen::Vector3d offset(1 << 20, -(1 << 19), 1 << 18);
  const TriangleMesh a = cluster_vertices(mesh, 100);
  const TriangleMesh b = cluster_vertices(moved(mesh, offset), 100);
  ASSERT_EQ(a.faces, b.faces);
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    EXPECT_LT((a.vertices[v] + offset - b.vertices[v]).norm(), 1e-9);
  }
}

TEST(VertexClustering, NothingLeftIsReportedAsEmpty) {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.faces = {{0, 0, 1}};
  EXPECT_TRUE(cluster_vertices(mesh, 80).empty());
  mesh.vertices.assign(4, {1, 2, 3});
  mesh.faces = {{0, 1, 2}};
  EXPECT_TRUE(cluster_vertices(mesh, 80).empty());
}

}  // namespace
}  // namespace organbake
