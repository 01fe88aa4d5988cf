// SPDX-License-Identifier: Apache-2.0

#include <Eigen/Dense>

#include "body/tissue.h"
#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "support/error_message.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake::deform {
namespace {

constexpr double kStep_s = 1.0 / 60;

// What the elements alone push with at x: inertia has nothing to say where a step begins and ends.
PaddedVectors elastic_forces(const FemBody& tissue, const PaddedVectors& x) {
  PaddedVectors force(tissue.size());
  tissue.local_step(x, x, x, force);
  return force;
}

PaddedVectors mapped(const FemBody& tissue, const Eigen::Affine3d& map) {
  PaddedVectors x = tissue.rest();
  for (PaddedVector& row : x) row = padded(map * Eigen::Vector3d(row.head<3>()));
  return x;
}

Eigen::Affine3d turned() {
  Eigen::Affine3d map(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()));
  map.translation() = Eigen::Vector3d(5, -70, 12);
  return map;
}

double largest(const PaddedVectors& rows) {
  double norm = 0;
  for (const PaddedVector& row : rows) norm = std::max(norm, row.norm());
  return norm;
}

// The patch test: a uniform strain leaves no force on any node within, however the elements lie.
TEST(FemBody, AnAffineMapLeavesInnerNodesAlone) {
  const test::FemBar bar;
  const FemBody tissue({{bar.mesh, bar.mechanics, {}}}, kStep_s);
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() << 1.1, 0.2, -0.1, 0.05, 0.9, 0.1, 0, -0.15, 1.2;
  const PaddedVectors force = elastic_forces(tissue, mapped(tissue, map));
  const double scale = largest(force);
  ASSERT_GT(scale, 1);
  const Eigen::Vector3d size = bar.size_mm();
  int inner = 0;
  for (std::size_t v = 0; v < bar.mesh.vertices.size(); ++v) {
    const Eigen::Vector3d& at = bar.mesh.vertices[v];
    if (at.minCoeff() <= 0 || (size - at).minCoeff() <= 0) continue;
    ++inner;
    // The node itself, not the vertex that it carries.
    for (std::size_t slot = 0; slot < tissue.free_count(); ++slot) {
      if (tissue.rest()[slot] != padded(at)) continue;
      EXPECT_LT(force[slot].norm(), 1e-12 * scale) << v;
    }
  }
  EXPECT_EQ(inner, 5);
}

// Stretched along x and drawn in sideways by ν: the ends pull with E A δ/L and the sides are free.
TEST(FemBody, AStretchedBarPullsByYoungsModulus) {
  for (const double nu : {0.0, 0.3, 0.45}) {
    test::FemOptions options;
    options.poisson_ratio = nu;
    const test::FemBar bar(options);
    const FemBody tissue({{bar.mesh, bar.mechanics, {}}}, kStep_s);
    constexpr double kStrain = 0.02;
    const Eigen::Affine3d map(Eigen::Scaling(1 + kStrain, 1 - nu * kStrain, 1 - nu * kStrain));
    const PaddedVectors force = elastic_forces(tissue, mapped(tissue, map));
    PaddedVector end = PaddedVector::Zero();
    double aside = 0;
    for (std::size_t slot = 0; slot < tissue.free_count(); ++slot) {
      if (tissue.rest()[slot].x() == bar.size_mm().x()) end += force[slot];
      aside = std::max({aside, std::abs(force[slot].y()), std::abs(force[slot].z())});
    }
    const double expected_mn = 10 * 20 * 20 * kStrain;  // 10 kPa = 10 mN/mm²
    EXPECT_NEAR(end.x(), -expected_mn, 1e-10 * expected_mn) << nu;
    EXPECT_LT(aside, 1e-10 * expected_mn) << nu;
  }
}

TEST(FemBody, TurningMakesNoForce) {
  const TriangleMesh mesh = test::lumpy_organ(2, 40, 7);
  const FemBody tissue({{mesh, test::fem_ball(mesh), {}}}, kStep_s);
  const double stretched =
      largest(elastic_forces(tissue, mapped(tissue, Eigen::Affine3d(Eigen::Scaling(1.01)))));
  EXPECT_LT(largest(elastic_forces(tissue, tissue.rest())), 1e-12 * stretched);
  EXPECT_LT(largest(elastic_forces(tissue, mapped(tissue, turned()))), 1e-9 * stretched);
}

// Forces are the energy's slope, also where elements are far from rest or inside out.
TEST(FemBody, ForcesAreTheEnergysSlope) {
  constexpr double kStep_mm = 1e-5, kRelative = 1e-5;  // central differences
  const TriangleMesh mesh = test::lumpy_organ(1, 40, 2);
  const FemBody tissue({{mesh, test::fem_ball(mesh), {}}}, kStep_s);
  RandomStream random(11);
  PaddedVectors x = tissue.rest();
  for (PaddedVector& row : x)
    row += padded({random.normal(), random.normal(), random.normal()}) * 15;
  const PaddedVectors force = elastic_forces(tissue, x);
  const PaddedVectors start = x;
  for (std::size_t slot = 0; slot < tissue.free_count(); ++slot) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto energy_at = [&](double moved) {
        PaddedVectors aside = x;
        aside[slot][axis] += moved;
        return tissue.energy(aside, aside);
      };
      const double slope = (energy_at(kStep_mm) - energy_at(-kStep_mm)) / (2 * kStep_mm);
      EXPECT_NEAR(force[slot][axis], -slope, kRelative * largest(force));
    }
  }
}

// Dampers resist a change of shape, and neither flying nor turning on.
TEST(FemBody, DampingKnowsStrainAlone) {
  const TriangleMesh mesh = test::lumpy_organ(2, 40, 7);
  test::FemOptions options;
  options.damping_s = 0.1;
  const FemBody tissue({{mesh, test::fem_ball(mesh, options), {}}}, kStep_s);
  const auto damping = [&](const Eigen::Affine3d& map) {
    PaddedVectors force(tissue.size());
    const PaddedVectors x = mapped(tissue, map);
    tissue.local_step(x, tissue.rest(), x, force);
    const PaddedVectors elastic = elastic_forces(tissue, x);
    for (std::size_t i = 0; i < force.size(); ++i) force[i] -= elastic[i];
    return largest(force);
  };
  const double stretched = damping(Eigen::Affine3d(Eigen::Scaling(1.001)));
  ASSERT_GT(stretched, 1e-3);
  EXPECT_LT(damping(Eigen::Affine3d(Eigen::Translation3d(3, 4, 5))), 1e-9 * stretched);
  const Eigen::AngleAxisd slightly(1e-4, Eigen::Vector3d::UnitY());
  EXPECT_LT(damping(Eigen::Affine3d(slightly)), 1e-3 * stretched) << "of second order";
}

// Inertia: the mass of a ball of tissue, and no force on one that flies on as it did.
TEST(FemBody, WeighsWhatTheTissueDoes) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  test::FemOptions options;
  options.anchored_below = -2;
  const FemBody tissue({{mesh, test::fem_ball(mesh, options), {}}}, kStep_s);
  PaddedVectors coasted = tissue.rest(), force(tissue.size());
  for (PaddedVector& row : coasted) row.x() += 1;
  tissue.local_step(tissue.rest(), tissue.rest(), coasted, force);
  PaddedVector sum = PaddedVector::Zero();
  for (const PaddedVector& row : force) sum += row;
  const double expected = 1060e-9 * signed_volume(mesh) * 60 * 60;
  EXPECT_NEAR(sum.x(), expected, 1e-9 * expected);
}

TEST(FemBody, SaysHowToBakeTetrahedra) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  DeformOptions options;
  options.solver = TissueSolver::fem;
  EXPECT_THAT(
      message_of(ExitCode::usage,
                 [&] { const Deformer deformer(mesh, test::spring_body(mesh), {}, options); }),
      testing::HasSubstr("mechanics.fem=false"));
}

using Eigen::Matrix3d;

Matrix3d lane_of(const Matrices& m, int lane) {
  Matrix3d result;
  for (int e = 0; e < 9; ++e) result(e / 3, e % 3) = m[e][lane];
  return result;
}

Matrices four(const Matrix3d (&m)[4]) {
  Matrices result;
  for (int lane = 0; lane < 4; ++lane)
    for (int e = 0; e < 9; ++e) result[e][lane] = m[lane](e / 3, e % 3);
  return result;
}

TEST(NearestRotations, SurviveWhatIsFlatOrNoNumber) {
  Matrix3d line = Matrix3d::Zero();
  line(0, 0) = 3;
  const Matrix3d f[4] = {Matrix3d::Zero(), line,
                         Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN()),
                         Eigen::Vector3d(1, 1, -1e-9).asDiagonal()};
  Matrices rotation;
  nearest_rotations(four(f), rotation);
  for (int lane = 0; lane < 4; ++lane) {
    EXPECT_NEAR(lane_of(rotation, lane).determinant(), 1, 1e-12) << lane;
  }
}

}  // namespace
}  // namespace organbake::deform
