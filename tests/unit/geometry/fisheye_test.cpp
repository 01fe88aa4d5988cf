// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/random.h"
#include "organbake/geometry/camera.h"

namespace organbake {
namespace {

constexpr double kDegree = 0.017453292519943295;

// Of a 1280 × 720 scope, so many degrees from side to side.
Intrinsics scope(double degrees, double k1 = -0.02, double k2 = 0.004) {
  Intrinsics k{1280, 720, 0, 0, 651, 352};
  k.model = LensModel::fisheye;
  k.k1 = k1, k.k2 = k2, k.k3 = -0.001, k.k4 = 0.0002;
  const double half = 0.5 * degrees * kDegree, h2 = half * half;
  k.fx = k.fy = 640 / (half * (1 + h2 * (k.k1 + h2 * (k.k2 + h2 * (k.k3 + h2 * k.k4)))));
  return k;
}

TEST(Fisheye, IsOpenCvsFormula) {
  const Intrinsics k = scope(140);
  const Eigen::Vector3d point(3, -4, 2.5);
  const double t = std::atan2(5, 2.5);
  const double r = t + k.k1 * std::pow(t, 3) + k.k2 * std::pow(t, 5) + k.k3 * std::pow(t, 7) +
                   k.k4 * std::pow(t, 9);
  const Eigen::Vector2d pixel = project(k, point);
  EXPECT_NEAR(pixel.x(), k.fx * r * 0.6 + k.cx, 1e-9);
  EXPECT_NEAR(pixel.y(), k.fy * r * -0.8 + k.cy, 1e-9);
  EXPECT_EQ(project(k, {0, 0, 7}), Eigen::Vector2d(k.cx, k.cy));
}

TEST(Fisheye, UnprojectUndoesProject) {
  constexpr double kPixelTolerance = 1e-9;
  RandomStream random(1);
  for (const double degrees : {100.0, 140.0, 170.0})
    for (int i = 0; i < 1000; ++i) {
      const Intrinsics k = scope(degrees, random.uniform(-0.05, 0.05), random.uniform(-0.01, 0.01));
      const double angle = random.uniform(0, 0.5 * degrees * kDegree),
                   turn = random.uniform(0, 6.28);
      const Eigen::Vector3d ray(std::tan(angle) * std::cos(turn), std::tan(angle) * std::sin(turn),
                                1);
      const Eigen::Vector2d pixel = project(k, 40 * ray);
      const Eigen::Vector3d again = unproject(k, pixel);
      EXPECT_EQ(again.z(), 1);
      EXPECT_LT((project(k, again) - pixel).norm(), kPixelTolerance) << degrees << ", " << angle;
      EXPECT_NEAR(std::atan(again.head<2>().norm()), angle, 1e-10);
    }
}

// Where its polynomial falls again no ray is known: the widest one, not one of the other branch.
TEST(Fisheye, EndsWhereItsPolynomialCeasesToRise) {
  Intrinsics k = scope(100);
  k.k1 = -0.5, k.k2 = k.k3 = k.k4 = 0;  // rises up to sqrt(2 / 3) rad
  const Eigen::Vector3d ray = unproject(k, {k.cx + k.fx, k.cy});
  EXPECT_TRUE(ray.allFinite());
  EXPECT_LT(std::atan(ray.x()), std::sqrt(2.0 / 3));
  EXPECT_GT(std::atan(ray.x()), 0.7);
}

TEST(PinholeOf, KeepsBrownsFocalLengths) {
  const Intrinsics lens{640, 480, 500, 510, 321, 238, -0.2, 0.05, 0.001, -0.002, 0.01};
  const Intrinsics pinhole = pinhole_of(lens);
  EXPECT_FALSE(pinhole.has_distortion());
  EXPECT_EQ(pinhole.fx, 500);
  EXPECT_EQ(pinhole.fy, 510);
  EXPECT_EQ(pinhole.cx, 321);
}

TEST(PinholeOf, ShowsAFisheyesMiddleUpTo120Degrees) {
  for (const double degrees : {90.0, 110.0, 140.0, 170.0}) {
    const Intrinsics lens = scope(degrees), pinhole = pinhole_of(lens);
    EXPECT_FALSE(pinhole.has_distortion());
    EXPECT_EQ(pinhole.width, lens.width);
    EXPECT_EQ(pinhole.cx, lens.cx);
    EXPECT_EQ(pinhole.fx, pinhole.fy);
    const double across = angle_across_rad(pinhole) / kDegree;
    // The axis lies a little beside the middle.
    EXPECT_NEAR(across, std::min(degrees, 120.0), 2) << degrees;
    EXPECT_NEAR(angle_across_rad(lens) / kDegree, degrees, 2);
  }
}

TEST(ScaledLens, SeesTheSameRaysAtAnotherSize) {
  const Intrinsics lens = scope(140);
  const Intrinsics half = scaled_lens(lens, 640, 360), third = scaled_lens(lens, 427, 240);
  const Eigen::Vector3d ray(0.4, -0.3, 1);
  EXPECT_LT((0.5 * project(lens, ray) - project(half, ray)).norm(), 1e-9);
  EXPECT_NEAR(project(third, ray).y(), project(lens, ray).y() / 3, 1e-9);
  EXPECT_NEAR(project(third, ray).x(), project(lens, ray).x() * 427 / 1280, 1e-9);
  // 1279 is halved to 639 by means of two pixels: the last one is lost, nothing is stretched.
  Intrinsics odd = lens;
  odd.width = 1279;
  EXPECT_EQ(scaled_lens(odd, 639, 360).fx, lens.fx / 2);
  EXPECT_TRUE(is_scaled_picture(odd, 639, 360));
  EXPECT_TRUE(is_scaled_picture(lens, 427, 240));
  EXPECT_FALSE(is_scaled_picture(lens, 640, 480));
}

}  // namespace
}  // namespace organbake
