// SPDX-License-Identifier: GPL-3.0-or-later
#include "finer_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

double farthest_from_sphere_mm(const TriangleMesh& mesh, double radius_mm) {
  double farthest = 0;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    farthest = std::max(farthest, std::abs(vertex.norm() - radius_mm));
  return farthest;
}

TEST(FinerSurface, IsAsFineAsAskedAndRounderThanItsFaces) {
  constexpr double kRadius_mm = 20;
  TriangleMesh coarse = make_icosphere(2);
  for (Eigen::Vector3d& vertex : coarse.vertices) vertex *= kRadius_mm;
  const TriangleMesh fine = finer_surface(coarse, 1.5);
  for (const Face& face : fine.faces)
    for (int i = 0; i < 3; ++i)
      EXPECT_LT((fine.vertices[face[i]] - fine.vertices[face[(i + 1) % 3]]).norm(), 2);
  // The middle of a face with edges of 6.3 mm lies 0.34 mm below the sphere, an edge's 0.25.
  EXPECT_LT(farthest_from_sphere_mm(fine, kRadius_mm), 0.35);
  EXPECT_GT(signed_volume(fine), signed_volume(coarse)) << "rounder, not smaller";
  EXPECT_TRUE(analyse_topology(fine).closed_manifold());
}

TEST(FinerSurface, KeepsBordersWhereTheyAre) {
  TriangleMesh square;
  square.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}};
  square.faces = {{0, 1, 2}, {0, 2, 3}};
  const TriangleMesh fine = finer_surface(square, 1);
  EXPECT_NEAR(surface_area(fine), 100, 1e-9);
}

}  // namespace
}  // namespace organbake
