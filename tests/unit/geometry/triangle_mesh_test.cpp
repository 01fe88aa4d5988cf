// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/meshes.h"

namespace organbake {
namespace {

TEST(TriangleMesh, KnowsVolumeAreaAndBounds) {
  const TriangleMesh box = box_mesh({2, 3, 4});
  EXPECT_NEAR(signed_volume(box), 24, 1e-12);
  EXPECT_NEAR(surface_area(box), 52, 1e-12);
  EXPECT_EQ(bounds(box).max, Eigen::Vector3d(2, 3, 4));
  EXPECT_NEAR(signed_volume(tetrahedron_mesh()), 1.0 / 6, 1e-15);
}

TEST(TriangleMesh, VolumeKeepsItsDigitsFarFromTheOrigin) {
  TriangleMesh box = box_mesh({2, 3, 4});
  for (auto& v : box.vertices) v += Eigen::Vector3d::Constant(1e6);
  EXPECT_NEAR(signed_volume(box), 24, 1e-6);
}

TEST(TriangleMesh, MirroringTurnsTheVolumesSign) {
  TriangleMesh lumpy = lumpy_mesh(50, 3);
  EXPECT_GT(signed_volume(lumpy), 0);
  for (auto& v : lumpy.vertices) v.x() = -v.x();
  EXPECT_LT(signed_volume(lumpy), 0);
}

TEST(VertexNormals, PointOutwardOnASphere) {
  const TriangleMesh sphere = sphere_mesh(10, 4);
  const auto normals = vertex_normals(sphere);
  constexpr double kTolerance = 4e-3;  // rad; the faceting of 5,120 faces gives 2.6e-3
  for (std::size_t v = 0; v < normals.size(); ++v) {
    EXPECT_LT((normals[v] - sphere.vertices[v] / 10).norm(), kTolerance);
  }
}

TEST(VertexNormals, DoNotDependOnHowASquareIsCut) {
  // The angle weights of the two triangulations of a box's sides add up to the same.
  for (const auto& n : vertex_normals(box_mesh({1, 1, 1}))) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(n[k]), 1 / std::numbers::sqrt3, 1e-12);
  }
}

TEST(VertexNormals, AreUnitEvenWithoutFaces) {
  TriangleMesh lone;
  lone.vertices = {{1, 2, 3}};
  EXPECT_EQ(vertex_normals(lone)[0], Eigen::Vector3d::UnitZ());
}

}  // namespace
}  // namespace organbake
