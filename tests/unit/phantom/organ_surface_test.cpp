// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

TEST(OrganSurface, VerticesLieOnTheFormula) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  const TriangleMesh surface = phantom.surface(5);
  EXPECT_EQ(surface.faces.size(), 20480u);
  for (const Vector3d& vertex : surface.vertices) EXPECT_NEAR(phantom.inside(vertex), 0, 1e-9);
  const MeshTopology topology = analyse_topology(surface);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.euler_characteristic, 2);
  EXPECT_GT(signed_volume(surface), 0);
}

TEST(OrganSurface, NormalsLookOutAndAgreeWithTheMesh) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  const TriangleMesh surface = phantom.surface(6);
  const std::vector<Vector3d> normals = vertex_normals(surface);
  double sum = 0;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const Vector3d normal = phantom.normal(surface.vertices[v]);
    EXPECT_NEAR(normal.norm(), 1, 1e-12);
    sum += normal.dot(normals[v]);
  }
  // Faces of 1 mm on bumps of 6 mm: the mesh's normals are some degrees off, on either side.
  EXPECT_GT(sum / static_cast<double>(normals.size()), 0.99);
}

TEST(OrganSurface, ColoursAreTheDiffuseLight) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  const TriangleMesh surface = phantom.surface(3);
  ASSERT_EQ(surface.colors.size(), surface.vertices.size());
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const Vector3d& point = surface.vertices[v];
    const Vector3d expected = phantom.albedo(point)
                                  .cast<double>()
                                  .cwiseProduct(studio_lighting().diffuse(phantom.normal(point)))
                                  .cwiseMin(1.0);
    EXPECT_LT((surface.colors[v].cast<double>() - expected).norm(), 1e-6);
    EXPECT_GT(surface.colors[v].minCoeff(), 0) << "no side may be black";
  }
}

TEST(OrganSurface, FillsTheSameShareOfAnyScan) {
  const auto outline = [](std::array<int, 3> size, Vector3d spacing) {
    OrganPhantomOptions options;
    options.ct_size = size;
    options.spacing_mm = spacing;
    const Bounds box = bounds(OrganPhantom(options).surface(4));
    return Vector3d((box.max - box.min)
                        .cwiseQuotient(spacing.cwiseProduct(Vector3d(size[0], size[1], size[2]))));
  };
  const Vector3d whole = outline({256, 256, 96}, {1, 1, 3});
  const Vector3d quarter = outline({64, 64, 24}, {1, 1, 3});
  const Vector3d finer = outline({512, 512, 192}, {0.5, 0.5, 1.5});
  constexpr double kBumps = 0.03;  // bumps keep their millimetres
  EXPECT_LT((whole - quarter).cwiseAbs().maxCoeff(), kBumps);
  EXPECT_LT((whole - finer).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(OrganSurface, RefusesOddSubdivisions) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  EXPECT_THROW(phantom.surface(-1), UsageError);
  EXPECT_THROW(phantom.surface(12), UsageError);
}

}  // namespace
}  // namespace organbake
