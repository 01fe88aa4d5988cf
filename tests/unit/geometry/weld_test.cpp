// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/weld.h"

#include <gtest/gtest.h>

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

TriangleMesh shifted(TriangleMesh mesh, RandomStream& random) {
  const Eigen::Vector3d shift(random.normal(), random.normal(), random.normal());
  for (Eigen::Vector3d& v : mesh.vertices)
    v = (v + 300 * shift).cast<float>().cast<double>();  // as files have them
  return mesh;
}

TEST(Weld, ASoupBecomesTheMeshThatItWas) {
  RandomStream random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const TriangleMesh mesh = shifted(lumpy_mesh(40, 1 + trial % 5), random);
    TriangleMesh soup = soup_of(mesh);
    const WeldSummary summary = weld(soup);
    EXPECT_EQ(summary.exact, 3 * mesh.faces.size() - mesh.vertices.size());
    EXPECT_EQ(soup.vertices.size(), mesh.vertices.size());
    EXPECT_EQ(soup.faces.size(), mesh.faces.size());
    EXPECT_EQ(analyse_topology(soup).boundary_edges, 0u);
  }
}

TEST(Weld, NearlyTheSamePlaceIsOneWhereThatClosesTheMesh) {
  RandomStream random(4);
  const TriangleMesh mesh = lumpy_mesh(40, 3);
  TriangleMesh soup = soup_of(mesh);
  for (Eigen::Vector3d& v : soup.vertices)
    v += 1e-6 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  EXPECT_GT(weld(soup).near, 0u);
  EXPECT_EQ(soup.vertices.size(), mesh.vertices.size());
  EXPECT_EQ(analyse_topology(soup).boundary_edges, 0u);
}

TEST(Weld, AClosedMeshStaysAsItIs) {
  TriangleMesh mesh = lumpy_mesh(40, 2);
  const std::vector<Eigen::Vector3d> before = mesh.vertices;
  EXPECT_EQ(weld(mesh).exact, 0u);
  EXPECT_EQ(mesh.vertices, before);
}

}  // namespace
}  // namespace organbake
