// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "organbake/geometry/mesh_checks.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

// The paper's phantom scan gave 80,744 faces; ours, on the same grid, must be as hard.
TEST(OrganIsosurface, HasThePapersFaceCountAndIsTheOrgan) {
  constexpr double kPaperFaces = 80744;
  const OrganPhantom phantom(OrganPhantomOptions{});
  IsosurfaceOptions options;
  options.iso_hu = -470;  // half-way between organ and air: where partial volume puts the surface
  const TriangleMesh mesh = extract_isosurface(phantom.scan(), options).mesh;
  EXPECT_NEAR(static_cast<double>(mesh.faces.size()) / kPaperFaces, 1, 0.1);
  const MeshTopology topology = analyse_topology(mesh);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.euler_characteristic, 2) << "one piece, no handles";

  double sum = 0;
  for (const auto& vertex : mesh.vertices) sum += std::abs(phantom.inside(vertex));
  // Slices 3 mm apart and a ramp that is not linear: a tenth of a slice.
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.size()), 0.3);
}

}  // namespace
}  // namespace organbake
