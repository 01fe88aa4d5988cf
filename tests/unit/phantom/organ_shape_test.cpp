// SPDX-License-Identifier: GPL-3.0-or-later
#include "organ_shape.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/geometry/icosphere.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

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

TEST(OrganShape, SurfacePointsAreTheZeroSet) {
  const OrganShape shape(7, 0.8, kCenter);
  for (const Vector3d& direction : make_icosphere(3).vertices) {
    const Vector3d point = shape.surface_point(direction);
    EXPECT_NEAR(shape.value(point), 0, 1e-12);
    EXPECT_GT(shape.value(kCenter + 0.9 * (point - kCenter)), 0);
    EXPECT_LT(shape.value(kCenter + 1.1 * (point - kCenter)), 0);
  }
}

// The scan skips voxels by these bounds, so they must hold between the directions they come from.
TEST(OrganShape, MeasuredBoundsHoldEverywhere) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const OrganShape shape(seed, 1, kCenter);
    for (const Vector3d& direction : make_icosphere(5).vertices) {
      const Vector3d point = shape.surface_point(direction);
      const double radius = (point - kCenter).norm();
      EXPECT_GT(radius, shape.inner_radius_mm());
      EXPECT_LT(radius, shape.outer_radius_mm());
      EXPECT_LT(shape.sample(point).gradient.norm(), shape.lipschitz());
    }
  }
}

TEST(OrganShape, FineBumpsAreAFewTenthsOfAMillimetre) {
  // Bumps are what remains of the radius after its mean over a cap wider than a bump.
  const OrganShape shape(1, 1, kCenter);
  double sum2 = 0, largest = 0;
  int count = 0;
  for (const Vector3d& direction : make_icosphere(3).vertices) {
    const Vector3d u = direction.unitOrthogonal(), v = direction.cross(u);
    double mean = 0;
    constexpr int kRing = 12;
    for (int k = 0; k < kRing; ++k) {
      const double angle = 2 * std::numbers::pi * k / kRing, reach = 0.06;  // 3–5 mm: half a bump
      mean += (shape.surface_point(
                   (direction + reach * (std::cos(angle) * u + std::sin(angle) * v)).normalized()) -
               kCenter)
                  .norm() /
              kRing;
    }
    const double bump = (shape.surface_point(direction) - kCenter).norm() - mean;
    sum2 += bump * bump;
    largest = std::max(largest, std::abs(bump));
    ++count;
  }
  EXPECT_GT(std::sqrt(sum2 / count), 0.1);
  EXPECT_GT(largest, 0.4);
  EXPECT_LT(largest, 2.5);
}

TEST(OrganShape, CentreAndOddPointsAreNoTrap) {
  const OrganShape shape(1, 1, kCenter);
  EXPECT_GT(shape.value(kCenter), 0);
  EXPECT_TRUE(shape.sample(kCenter).gradient.allFinite());
  EXPECT_LT(shape.value(Vector3d(1e12, 0, 0)), 0);
  EXPECT_TRUE(
      std::isnan(shape.value(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()))));
}

// A mirrored or transposed organ must not pass for the organ: every such copy, laid centre on
// centre, misses the surface by several millimetres on average.
TEST(OrganShape, IsAsymmetricInEveryAxis) {
  OrganPhantomOptions options;
  const OrganPhantom phantom(options);
  const TriangleMesh surface = phantom.surface(4);
  const Vector3d center = bounds(surface).center();
  const auto mean_miss_mm = [&](const Eigen::Matrix3d& map) {
    double sum = 0;
    for (const Vector3d& vertex : surface.vertices)
      sum += std::abs(phantom.inside(center + map * (vertex - center)));
    return sum / static_cast<double>(surface.vertices.size());
  };
  EXPECT_NEAR(mean_miss_mm(Eigen::Matrix3d::Identity()), 0, 1e-9);
  constexpr double kPlainMm = 4;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix3d mirror = Eigen::Matrix3d::Identity();
    mirror(axis, axis) = -1;
    EXPECT_GT(mean_miss_mm(mirror), kPlainMm) << "mirrored in axis " << axis;
    Eigen::Matrix3d swap = Eigen::Matrix3d::Identity();
    swap.col(axis).swap(swap.col((axis + 1) % 3));
    EXPECT_GT(mean_miss_mm(swap), kPlainMm) << "axes " << axis << " and the next swapped";
    EXPECT_GT(mean_miss_mm(-mirror), kPlainMm) << "turned half round axis " << axis;
  }
  EXPECT_GT(mean_miss_mm(-Eigen::Matrix3d::Identity()), kPlainMm);
}

TEST(OrganShape, TheSeedMakesAnotherOrgan) {
  const OrganShape a(1, 1, kCenter), again(1, 1, kCenter), b(2, 1, kCenter);
  const Vector3d direction = Vector3d(0.3, 0.5, 0.8).normalized();
  EXPECT_EQ(a.surface_point(direction), again.surface_point(direction));
  EXPECT_GT((a.surface_point(direction) - b.surface_point(direction)).norm(), 0.05);
}

}  // namespace
}  // namespace organbake
