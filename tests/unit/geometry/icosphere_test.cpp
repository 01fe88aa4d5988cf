// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/icosphere.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"

namespace organbake {
namespace {

TEST(Icosphere, IsAClosedSphereOfTwentyTimesFourToTheN) {
  std::size_t faces = 20;
  for (int subdivisions = 0; subdivisions <= 4; ++subdivisions, faces *= 4) {
    const TriangleMesh sphere = make_icosphere(subdivisions);
    const MeshTopology topology = analyse_topology(sphere);
    EXPECT_EQ(sphere.faces.size(), faces);
    EXPECT_TRUE(topology.closed_manifold());
    EXPECT_EQ(topology.euler_characteristic, 2);
    EXPECT_GT(signed_volume(sphere), 0) << "faces must look outward";
    for (const auto& vertex : sphere.vertices) EXPECT_NEAR(vertex.norm(), 1, 1e-15);
  }
}

TEST(Icosphere, CoarseVerticesComeFirst) {
  const TriangleMesh coarse = make_icosphere(2), fine = make_icosphere(3);
  for (std::size_t v = 0; v < coarse.vertices.size(); ++v)
    EXPECT_EQ(coarse.vertices[v], fine.vertices[v]);
}

TEST(Icosphere, RefusesOddCounts) {
  EXPECT_THROW(make_icosphere(-1), UsageError);
  EXPECT_THROW(make_icosphere(10), UsageError);
}

}  // namespace
}  // namespace organbake
