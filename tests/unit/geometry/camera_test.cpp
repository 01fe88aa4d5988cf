// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/camera.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

Intrinsics lens() { return {640, 480, 500, 510, 321, 238, -0.2, 0.05, 0.001, -0.002, 0.01}; }

TEST(LookAt, PutsTheTargetOnTheAxisAndUpAtTheTop) {
  const Eigen::Vector3d eye(10, -200, 30), target(1, 2, 3);
  const RigidTransform t = look_at(eye, target, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR((t * eye).norm(), 0, 1e-12);
  EXPECT_NEAR((t * target - Eigen::Vector3d(0, 0, (target - eye).norm())).norm(), 0, 1e-12);
  EXPECT_LT((t * (target + Eigen::Vector3d::UnitZ())).y(), 0);  // y runs down
  // Looking along +y with z up, world +x is at the right: a mirrored frame fails here.
  EXPECT_GT((t * (target + Eigen::Vector3d::UnitX())).x(), 0);
  EXPECT_NEAR(t.rotation.determinant(), 1, 1e-12);
}

TEST(LookAt, SurvivesAnUpAlongTheView) {
  const RigidTransform t = look_at({0, 0, 10}, {0, 0, 0}, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(t.rotation.allFinite());
  EXPECT_NEAR(t.rotation.determinant(), 1, 1e-12);
}

TEST(Project, TheCentreOfTheFirstPixelIsHalf) {
  const Intrinsics k{4, 4, 2, 2, 2, 2};
  EXPECT_EQ(project(k, {-0.75, -0.75, 1}), Eigen::Vector2d(0.5, 0.5));
}

TEST(Unproject, UndoesProjectWithDistortion) {
  constexpr double kPixelTolerance = 1e-8;  // 1e-12 of normalised coordinates × the focal length
  RandomStream random(1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d pixel(random.uniform(0, 640), random.uniform(0, 480));
    const Eigen::Vector3d ray = unproject(lens(), pixel);
    EXPECT_EQ(ray.z(), 1);
    EXPECT_LT((project(lens(), 73.0 * ray) - pixel).norm(), kPixelTolerance);
  }
}

TEST(Intrinsics, AreChecked) {
  EXPECT_NO_THROW(lens().check());
  const auto broken = [](auto change) {
    Intrinsics k = lens();
    change(k);
    return k;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(broken([](auto& k) { k.width = 0; }).check(), BadDataError);
  EXPECT_THROW(broken([](auto& k) { k.height = 65537; }).check(), BadDataError);
  EXPECT_THROW(broken([](auto& k) { k.fx = -1; }).check(), BadDataError);
  EXPECT_THROW(broken([&](auto& k) { k.fy = nan; }).check(), BadDataError);
  EXPECT_THROW(broken([&](auto& k) { k.cx = nan; }).check(), BadDataError);
  EXPECT_THROW(broken([&](auto& k) { k.k3 = nan; }).check(), BadDataError);
}

}  // namespace
}  // namespace organbake
