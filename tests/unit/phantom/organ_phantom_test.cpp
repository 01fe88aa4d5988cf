// SPDX-License-Identifier: GPL-3.0-or-later

#include "formulas.h"
#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/refine.h"
#include "organbake/phantom/phantom.h"
#include "support/testing.h"

namespace organbake {
namespace {

TEST(OrganPhantomOptions, TheSmallestOrganIsStillAnOrgan) {
  OrganPhantomOptions options;
  options.ct_size = {8, 8, 8};
  options.spacing_mm = {0.05, 0.05, 0.05};
  const OrganPhantom phantom(options);
  EXPECT_GT(signed_volume(phantom.surface(3)), 0);
  EXPECT_EQ(phantom.scan().voxels.size(), 512u);
}

using Eigen::Vector3d;

const Vector3d kCenter{3, -4, 5};

TEST(OrganShape, SampleIsTheValueWithItsGradient) {
  const OrganShape shape(1, 1, kCenter);
  constexpr double kStep = 1e-5;
  constexpr double kTolerance =
      1e-8;  // central differences: step² times third derivatives below 10
  for (const Vector3d& direction : make_icosphere(2).vertices) {
    const Vector3d point = kCenter + 61.3 * direction;
    const OrganShape::Sample at = shape.sample(point);
    EXPECT_NEAR(at.value, shape.value(point), 1e-12);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep * Vector3d::Unit(axis);
      const double slope = (shape.value(point + step) - shape.value(point - step)) / (2 * kStep);
      EXPECT_NEAR(at.gradient[axis], slope, kTolerance);
    }
  }
}

TEST(OrganShape, CentreAndOddPointsAreNoTrap) {
  const OrganShape shape(1, 1, kCenter);
  EXPECT_GT(shape.value(kCenter), 0);
  EXPECT_TRUE(shape.sample(kCenter).gradient.allFinite());
  EXPECT_LT(shape.value(Vector3d(1e12, 0, 0)), 0);
  EXPECT_TRUE(
      std::isnan(shape.value(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()))));
}

TEST(OrganShape, TheSeedMakesAnotherOrgan) {
  const OrganShape a(1, 1, kCenter), again(1, 1, kCenter), b(2, 1, kCenter);
  const Vector3d direction = Vector3d(0.3, 0.5, 0.8).normalized();
  EXPECT_EQ(a.surface_point(direction), again.surface_point(direction));
  EXPECT_GT((a.surface_point(direction) - b.surface_point(direction)).norm(), 0.05);
}

// Measured image errors depend on the organ, so its formula is frozen: whoever changes one of these
// numbers has made another phantom, and every figure that was measured on it is void.
struct Frozen {
  Vector3d world_mm;
  double inside_mm;
  Vector3d albedo;
};
const Frozen kFrozen[] = {
    {{0, 0, 0}, 13.49806411438, {0.24011793660, 0.04500873473, 0.02944289081}},
    {{60, -20, 40}, 42.75385832589, {0.21170917038, 0.03982523724, 0.02555163473}},
    {{-40, 0, 30}, 15.68131595563, {0.26381091753, 0.06057283689, 0.03994068549}},
    {{16, -60, 20}, -1.62043931662, {0.17965770520, 0.03683413255, 0.02459901008}},
    {{16, 30, 60}, 0.40418373436, {0.22387125800, 0.04752608671, 0.03090621807}},
    {{-200, 500, 10}, -499.24780539507, {0.13826406508, 0.02633676912, 0.01930253264}},
    {{6.25, 34.5, 17.75}, 0.14057451652, {0.13117516001, 0.01934858497, 0.02303997627}},
    {{-7.5, -18.25, 94}, -0.00340124251, {0.57176923231, 0.35842672505, 0.14598687025}},
    {{14.5, -27, -15.25}, -0.00380992648, {0.19836248987, 0.26081805656, 0.07398998560}},
};
constexpr double kFrozenTolerance = 1e-9;  // libm and fused multiply-adds differ in the last digits

TEST(OrganFormula, IsFrozen) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  const OrganShape shape(1, 1, Vector3d(16.3, -11.7, 34.0));
  const OrganTexture texture(1, shape);
  for (const Frozen& frozen : kFrozen) {
    EXPECT_NEAR(phantom.inside(frozen.world_mm), frozen.inside_mm, kFrozenTolerance);
    EXPECT_NEAR(shape.value(frozen.world_mm), frozen.inside_mm, kFrozenTolerance);
    const Vector3d albedo = texture.albedo(frozen.world_mm);
    EXPECT_LT((albedo - frozen.albedo).cwiseAbs().maxCoeff(), kFrozenTolerance)
        << albedo.transpose();
    EXPECT_EQ(phantom.albedo(frozen.world_mm), albedo.cast<float>());
  }
}

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
