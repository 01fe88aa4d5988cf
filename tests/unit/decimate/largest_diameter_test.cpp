// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/largest_diameter.h"

#include <gtest/gtest.h>

#include "organbake/core/random.h"
#include "support/meshes.h"

namespace organbake {
namespace {

constexpr double kPrecision = 1.1e-5;

TEST(LargestDiameter, OfABoxIsItsDiagonalAndOfABallTwiceItsRadius) {
  const Eigen::Vector3d size(3, 4, 12);
  EXPECT_NEAR(largest_diameter_mm(box_mesh(size)) / 13, 1, kPrecision);
  // Every vertex is as far from its opposite: what is hard for a search that halves boxes.
  const TriangleMesh ball = moved(sphere_mesh(50, 6), {1000, -300, 7});
  EXPECT_NEAR(largest_diameter_mm(ball) / 100, 1, kPrecision);
}

TEST(LargestDiameter, IsThatOfAllPairs) {
  RandomStream random(5);
  for (int cloud = 0; cloud < 20; ++cloud) {
    TriangleMesh mesh;
    double right = 0;
    for (int i = 0; i < 200; ++i) {
      mesh.vertices.emplace_back(random.normal(), 3 * random.normal(), 0.2 * random.normal());
      for (const Eigen::Vector3d& other : mesh.vertices)
        right = std::max(right, (other - mesh.vertices.back()).norm());
    }
    EXPECT_NEAR(largest_diameter_mm(mesh) / right, 1, kPrecision);
  }
}

TEST(LargestDiameter, OfNothingIsNothing) {
  EXPECT_EQ(largest_diameter_mm({}), 0);
  TriangleMesh one;
  one.vertices = {{1, 2, 3}};
  EXPECT_EQ(largest_diameter_mm(one), 0);
  one.vertices.assign(100, {1, 2, 3});
  EXPECT_EQ(largest_diameter_mm(one), 0);
}

}  // namespace
}  // namespace organbake
