// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/dense_solve.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kRounding = 1e-12;

TEST(DenseSolve, ReadsTheLowerTriangleAlone) {
  Eigen::Matrix3d matrix;
  matrix << 4, 100, 100, 1, 3, 100, -1, 0.5, 2;
  const Eigen::Matrix3d whole = matrix.selfadjointView<Eigen::Lower>();
  const Vector3d x(1, -2, 3);
  EXPECT_LT((solve_symmetric(matrix, whole * x) - x).norm(), kRounding);
}

TEST(DenseSolve, FindsTheLeastSquares) {
  MatrixXd rows(4, 2);
  rows << 1, 0, 1, 1, 1, 2, 1, 3;
  const auto line = solve_least_squares(rows, VectorXd(Eigen::Vector4d(1, 3, 5, 11)));
  ASSERT_TRUE(line);
  EXPECT_NEAR((*line)[0], 0.2, kRounding);
  EXPECT_NEAR((*line)[1], 3.2, kRounding);
}

TEST(DenseSolve, FindsNothingWhereTheRowsDoNotFixIt) {
  MatrixXd rows(3, 2);
  rows << 1, 2, 2, 4, -3, -6;
  EXPECT_FALSE(solve_least_squares(rows, VectorXd(Vector3d(1, 2, 3))));
}

TEST(RotationBetween, BringsOneDirectionToTheOtherByTheLeastTurn) {
  const Vector3d from(0, 0, 2), to(3, 0, 3);
  const Eigen::AngleAxisd turn(rotation_between(from, to));
  EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), kRounding);
  EXPECT_NEAR(turn.angle(), M_PI / 4, kRounding);
  const Vector3d back = rotation_between(from, -from) * from;
  EXPECT_LT((back + from).norm(), 1e-6);
}

}  // namespace
}  // namespace organbake
