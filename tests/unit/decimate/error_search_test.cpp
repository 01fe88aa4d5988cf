// SPDX-License-Identifier: GPL-3.0-or-later
#include "error_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"
#include "unit/decimate/seeded_meshes.h"

namespace organbake {
namespace {

TEST(VerifiedDistance, SeesASingleVertexThatSticksOut) {
  const TriangleMesh mesh = sphere_mesh(50, 4);
  TriangleMesh spiked = mesh;
  spiked.vertices[17] *= 1.1;
  EXPECT_NEAR(verified_distance(mesh, spiked), 5, 0.1);
  EXPECT_NEAR(verified_distance(spiked, mesh), 5, 0.1);
}

// A surface with a border, the hardest kind; all fifty take minutes.
TEST(MaxError, IsKeptWithFewFaces) {
  for (const std::uint64_t seed : {29}) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = manifold_faces(seeded_mesh(seed));
    DecimateOptions options{.max_error_mm = 0.02 * bounds(mesh).diagonal()};
    const DecimateResult s = decimate(mesh, options);
    EXPECT_LE(verified_distance(mesh, s.proxy), options.max_error_mm);
    EXPECT_LE(s.max_mm, options.max_error_mm);
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

}  // namespace
}  // namespace organbake
