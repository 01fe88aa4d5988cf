// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

double longest_edge(const TriangleMesh& mesh) {
  double longest = 0;
  for (const Face& f : mesh.faces) {
    for (int i = 0; i < 3; ++i) {
      longest = std::max(longest, (mesh.vertices[f[i]] - mesh.vertices[f[(i + 1) % 3]]).norm());
    }
  }
  return longest;
}

TEST(RefineEdges, KeepsTheSurfaceAndLeavesNoLongEdge) {
  const TriangleMesh lumpy = lumpy_mesh(50, 2);
  for (const double longest : {40.0, 9.0, 4.0}) {
    const RefinedMesh fine = refine_edges(lumpy, longest);
    EXPECT_LE(longest_edge(fine.mesh), longest);
    EXPECT_TRUE(analyse_topology(fine.mesh).closed_manifold());
    EXPECT_NEAR(signed_volume(fine.mesh), signed_volume(lumpy), 1e-9 * signed_volume(lumpy));
    EXPECT_NEAR(surface_area(fine.mesh), surface_area(lumpy), 1e-9 * surface_area(lumpy));
  }
}

TEST(RefineEdges, KnowsWhereEachVertexLies) {
  const TriangleMesh box = box_mesh({7, 2, 5});
  const RefinedMesh fine = refine_edges(box, 0.8);
  ASSERT_EQ(fine.places.size(), fine.mesh.vertices.size());
  for (std::size_t v = 0; v < fine.places.size(); ++v) {
    const auto& [face, u, w] = fine.places[v];
    const Face& f = box.faces[face];
    const Eigen::Vector3d there =
        (1 - u - w) * box.vertices[f[0]] + u * box.vertices[f[1]] + w * box.vertices[f[2]];
    EXPECT_LT((there - fine.mesh.vertices[v]).norm(), 1e-5);
  }
}

TEST(RefineEdges, LeavesAFineMeshAlone) {
  const TriangleMesh sphere = sphere_mesh(1, 3);
  const RefinedMesh same = refine_edges(sphere, 10);
  EXPECT_EQ(same.mesh.faces, sphere.faces);
  EXPECT_EQ(same.mesh.vertices, sphere.vertices);
}

TEST(RefineEdges, RefusesWhatMakesNoSense) {
  const TriangleMesh box = box_mesh({1, 1, 1});
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(refine_edges(box, bad), UsageError);
  }
  EXPECT_THROW(refine_edges(box, 1e-3, 10'000), UsageError);
}

}  // namespace
}  // namespace organbake
