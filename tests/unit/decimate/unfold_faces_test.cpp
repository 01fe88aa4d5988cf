// SPDX-License-Identifier: GPL-3.0-or-later
#include "unfold_faces.h"

#include <gtest/gtest.h>

#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// A flat square of 3 × 3 vertices whose middle one is pulled over the far edge of a face round it.
TriangleMesh folded_square() {
  TriangleMesh mesh;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) mesh.vertices.emplace_back(x, y, 0);
  for (const std::uint32_t i : {0u, 1u, 3u, 4u}) {
    mesh.faces.push_back({i, i + 1, i + 4});
    mesh.faces.push_back({i, i + 4, i + 3});
  }
  mesh.vertices[4] = {1.7, 0.5, 0};
  return mesh;
}

std::size_t faces_down(const TriangleMesh& mesh) {
  std::size_t count = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) count += face_normal(mesh, f).z() < 0;
  return count;
}

TEST(UnfoldFaces, TurnsAFoldedSliverUp) {
  TriangleMesh mesh = folded_square();
  ASSERT_EQ(faces_down(mesh), 1u);
  EXPECT_GT(unfold_faces(mesh), 0u);
  EXPECT_EQ(faces_down(mesh), 0u);
  double sum = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) sum += face_area(mesh, f);
  EXPECT_NEAR(sum, 4, 1e-12) << "the square is covered once";
  const MeshTopology topology = analyse_topology(mesh);
  EXPECT_EQ(topology.non_manifold_edges + topology.misoriented_edges, 0u);
  EXPECT_EQ(topology.euler_characteristic, 1);
}

TEST(UnfoldFaces, LeavesWhatIsNotFoldedAlone) {
  for (const TriangleMesh& mesh :
       {lumpy_mesh(50, 3), tetrahedron_mesh(), grid_box({30, 20, 1}, 4)}) {
    TriangleMesh after = mesh;
    EXPECT_EQ(unfold_faces(after), 0u);
    EXPECT_EQ(after.faces, mesh.faces);
  }
}

// The edge of a thin lobe is sharper than a right angle, and stays.
TEST(UnfoldFaces, LeavesASharpRimAlone) {
  TriangleMesh mesh = lumpy_mesh(50, 3);
  for (Vector3d& v : mesh.vertices) v.z() *= 0.05;
  TriangleMesh after = mesh;
  unfold_faces(after);
  EXPECT_NEAR(signed_volume(after) / signed_volume(mesh), 1, 2e-3);
  EXPECT_TRUE(analyse_topology(after).closed_manifold());
}

TEST(UnfoldFaces, SurvivesFacesOfNoArea) {
  TriangleMesh mesh = lumpy_mesh(50, 3);
  for (std::size_t f = 0; f < 40; ++f)
    mesh.vertices[mesh.faces[f * 20][0]] = mesh.vertices[mesh.faces[f * 20][1]];
  unfold_faces(mesh);
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
  EXPECT_EQ(analyse_topology(mesh).euler_characteristic, 2);
}

}  // namespace
}  // namespace organbake
