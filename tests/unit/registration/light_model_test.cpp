// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/registration/light_model.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

using Eigen::Vector3d;

ShadingBasis::Weights some_weights() {
  ShadingBasis::Weights weights;
  for (int j = 0; j < ShadingBasis::kMost; ++j) weights[j] = 0.3 + 0.17 * j * (j % 2 ? 1 : -1);
  weights[0] = 1.2;
  return weights;
}

double radiance(const ShadingBasis& basis, const Vector3d& x, const Vector3d& n) {
  double phi[ShadingBasis::kMost];
  basis.values(x, n, phi);
  return Eigen::VectorXd::Map(phi, basis.size()).dot(some_weights().head(basis.size()));
}

TEST(ShadingBasis, GradientIsTheFiniteDifferences) {
  const Vector3d x(20, -35, 260), n = Vector3d(0.3, 0.2, -0.9).normalized();
  for (const LightModel model :
       {LightModel::camera, LightModel::beam, LightModel::direction, LightModel::estimated}) {
    const ShadingBasis basis({model, {0.2, -0.5, -0.8}, 0.2}, 250);
    const auto g = basis.gradient(x, n, some_weights());
    constexpr double kStep = 1e-5;
    for (int j = 0; j < 3; ++j) {
      const Vector3d step = kStep * Vector3d::Unit(j);
      const double by_x =
          (radiance(basis, x + step, n) - radiance(basis, x - step, n)) / (2 * kStep);
      const double by_n =
          (radiance(basis, x, n + step) - radiance(basis, x, n - step)) / (2 * kStep);
      EXPECT_NEAR(g.by_point[j], by_x, 1e-7) << int(model) << " axis " << j;
      EXPECT_NEAR(g.by_normal[j], by_n, 1e-7) << int(model) << " axis " << j;
    }
  }
}

TEST(ShadingBasis, LampAtTheCameraIsOneFacingItAtTheReference) {
  const ShadingBasis basis({}, 200);
  double phi[ShadingBasis::kMost];
  basis.values({0, 0, 200}, {0, 0, -1}, phi);
  EXPECT_DOUBLE_EQ(phi[0], 1);
  basis.values({0, 0, 400}, {0, 0, -1}, phi);
  EXPECT_DOUBLE_EQ(phi[0], 0.25) << "falls with the distance squared";
  basis.values({0, 0, 200}, {0, 0, 1}, phi);
  EXPECT_DOUBLE_EQ(phi[0], 0) << "lights no back";
}

}  // namespace
}  // namespace organbake
