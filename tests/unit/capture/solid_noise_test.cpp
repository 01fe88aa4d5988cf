// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/solid_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Vector3d random_point(RandomStream& random) {
  return {random.uniform(-90, 90), random.uniform(-90, 90), random.uniform(-90, 90)};
}

TEST(SolidNoise, IsCentredWithItsDocumentedSpread) {
  const SolidNoise noise(3, 4.0);
  RandomStream random(1);
  double sum = 0, sum2 = 0, largest = 0;
  constexpr int kPoints = 100000;
  for (int i = 0; i < kPoints; ++i) {
    const double value = noise.value(random_point(random));
    sum += value;
    sum2 += value * value;
    largest = std::max(largest, std::abs(value));
  }
  EXPECT_NEAR(sum / kPoints, 0, 0.005);
  EXPECT_NEAR(std::sqrt(sum2 / kPoints), 0.19, 0.01);
  EXPECT_LT(largest, 1.5);
}

TEST(SolidNoise, GradientIsTheValuesSlopeAlsoAcrossCells) {
  const SolidNoise noise(3, 4.0);
  RandomStream random(2);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 2000; ++i) {
    Vector3d point = random_point(random);
    if (i % 4 == 0) point[i % 3] = 4.0 * std::round(point[i % 3] / 4.0);  // on a cell's wall
    const NoiseSample at = noise.sample(point);
    EXPECT_NEAR(at.value, noise.value(point), 1e-14);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep * Vector3d::Unit(axis);
      const double slope = (noise.value(point + step) - noise.value(point - step)) / (2 * kStep);
      EXPECT_NEAR(at.gradient_per_mm[axis], slope, 1e-7);
    }
  }
}

TEST(SolidNoise, SeedsAndCellsMatter) {
  const Vector3d point(1.7, -2.3, 5.1);
  EXPECT_EQ(SolidNoise(1, 4.0).value(point), SolidNoise(1, 4.0).value(point));
  EXPECT_NE(SolidNoise(1, 4.0).value(point), SolidNoise(2, 4.0).value(point));
  EXPECT_NEAR(SolidNoise(1, 4.0).value(point), SolidNoise(1, 8.0).value(2 * point), 1e-14);
}

TEST(SolidNoise, AbsurdPointsAreZero) {
  const SolidNoise noise(1, 4.0);
  for (const double value : {1e300, -1e12, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(noise.value(Vector3d(0.3, value, 0.2)), 0);
    EXPECT_EQ(noise.sample(Vector3d(value, 0.1, 0.2)).gradient_per_mm.norm(), 0);
  }
}

}  // namespace
}  // namespace organbake
