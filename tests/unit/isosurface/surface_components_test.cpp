// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/surface_components.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

void append(TriangleMesh& mesh, TriangleMesh part, const Eigen::Vector3d& at, bool inside_out) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3d& v : part.vertices) mesh.vertices.push_back(v + at);
  for (Face face : part.faces) {
    if (inside_out) std::swap(face[1], face[2]);
    mesh.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
  }
}

// Far from the origin, where sums of signed volumes lose their digits.
const Eigen::Vector3d kFar(1000, -2000, 1500);

TriangleMesh ball_with_cavity_and_crumb() {
  TriangleMesh mesh;
  append(mesh, sphere_mesh(1, 1), kFar + Eigen::Vector3d(30, 0, 0), false);
  append(mesh, sphere_mesh(8, 2), kFar, true);
  append(mesh, sphere_mesh(10, 2), kFar, false);
  return mesh;
}

TEST(SurfaceComponents, TheLargestOutwardPieceIsTheOrgan) {
  const KeptComponents kept =
      keep_components(ball_with_cavity_and_crumb(), {.largest = 1, .outward_only = true});
  EXPECT_EQ(kept.found, 3u);
  EXPECT_EQ(kept.kept, 1u);
  EXPECT_NEAR(bounds(kept.mesh).max.x() - kFar.x(), 10, 0.5);
  EXPECT_TRUE(analyse_topology(kept.mesh).closed_manifold());
  EXPECT_EQ(analyse_topology(kept.mesh).unused_vertices, 0u);
}

TEST(SurfaceComponents, CavitiesGoWhenPiecesAreCounted) {
  const KeptComponents kept =
      keep_components(ball_with_cavity_and_crumb(), {.largest = 3, .outward_only = true});
  EXPECT_EQ(kept.kept, 2u);  // ball and crumb
}

TEST(SurfaceComponents, AllMeansAll) {
  EXPECT_EQ(
      keep_components(ball_with_cavity_and_crumb(), {.largest = 0, .outward_only = true}).kept, 3u);
  EXPECT_EQ(
      keep_components(ball_with_cavity_and_crumb(), {.largest = 2, .outward_only = false}).kept,
      2u);
}

TEST(SurfaceComponents, ASingleInwardPieceIsKept) {
  TriangleMesh mesh;
  append(mesh, sphere_mesh(8, 2), kFar, true);
  append(mesh, sphere_mesh(2, 2), kFar, true);
  EXPECT_EQ(keep_components(mesh, {.largest = 1, .outward_only = true}).kept, 1u);
}

TEST(SurfaceComponents, SmallPiecesGo) {
  const auto kept = [](double min_size_mm) {
    return keep_components(ball_with_cavity_and_crumb(),
                           {.largest = 0, .min_size_mm = min_size_mm});
  };
  EXPECT_EQ(kept(1).kept, 3u);
  EXPECT_EQ(kept(3).kept, 2u);  // the crumb of 2 mm
  EXPECT_EQ(kept(17).kept, 1u);
  EXPECT_TRUE(kept(30).mesh.empty());
  EXPECT_EQ(analyse_topology(kept(17).mesh).unused_vertices, 0u);
  EXPECT_NEAR(bounds(kept(17).mesh).max.x() - kFar.x(), 10, 0.5);
}

TEST(SurfaceComponents, AnEmptyMeshStaysEmpty) {
  EXPECT_EQ(keep_components({}, {.largest = 1, .outward_only = true}).found, 0u);
}

}  // namespace
}  // namespace organbake
