// SPDX-License-Identifier: GPL-3.0-or-later
#include "vertex_clustering.h"

#include <gtest/gtest.h>

#include <set>

#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

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
