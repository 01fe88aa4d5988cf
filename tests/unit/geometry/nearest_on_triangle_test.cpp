// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/nearest_on_triangle.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Vector3d random_point(RandomStream& random) {
  return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

TEST(NearestOnTriangle, NoSampledPointIsNearer) {
  RandomStream random(3);
  for (int round = 0; round < 300; ++round) {
    const Vector3d a = random_point(random), b = random_point(random), c = random_point(random),
                   p = 2 * random_point(random);
    const Vector3d w = nearest_on_triangle(p, a, b, c);
    ASSERT_GE(w.minCoeff(), -1e-12);
    ASSERT_NEAR(w.sum(), 1, 1e-12);
    const double found = (w[0] * a + w[1] * b + w[2] * c - p).norm();
    for (int sample = 0; sample < 200; ++sample) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      ASSERT_LE(found, ((1 - u - v) * a + u * b + v * c - p).norm() + 1e-12);
    }
  }
}

TEST(NearestOnTriangle, APointGivesThePoint) {
  const Vector3d a(1, 2, 3);
  const Vector3d w = nearest_on_triangle({0, 0, 0}, a, a, a);
  EXPECT_TRUE(w.allFinite());
  EXPECT_NEAR(w.sum(), 1, 1e-15);
}

}  // namespace
}  // namespace organbake
