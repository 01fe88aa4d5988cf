// SPDX-License-Identifier: Apache-2.0
#include "body/element_stress.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>

#include "organbake/core/random.h"

namespace organbake::deform {
namespace {

using Eigen::Matrix3d;

Matrix3d lane_of(const Matrices& m, int lane) {
  Matrix3d result;
  for (int e = 0; e < 9; ++e) result(e / 3, e % 3) = m[e][lane];
  return result;
}

Matrix3d random_matrix(RandomStream& random) {
  Matrix3d m;
  for (int e = 0; e < 9; ++e) m(e / 3, e % 3) = random.normal();
  return m;
}

// By brute force: the best of U diag(±1, ±1, ±1) Vᵀ with determinant 1.
Matrix3d by_definition(const Matrix3d& f) {
  const Eigen::JacobiSVD<Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d best = Matrix3d::Identity();
  double least = std::numeric_limits<double>::infinity();
  for (int signs = 0; signs < 8; ++signs) {
    const Eigen::Vector3d s(signs & 1 ? -1 : 1, signs & 2 ? -1 : 1, signs & 4 ? -1 : 1);
    const Matrix3d r = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
    if (r.determinant() < 0 || (f - r).norm() >= least) continue;
    least = (f - r).norm();
    best = r;
  }
  return best;
}

Matrices four(const Matrix3d (&m)[4]) {
  Matrices result;
  for (int lane = 0; lane < 4; ++lane)
    for (int e = 0; e < 9; ++e) result[e][lane] = m[lane](e / 3, e % 3);
  return result;
}

TEST(NearestRotations, AreTheNearest) {
  constexpr double kWithin = 1e-7;  // next to a reflection the nearest turns fast
  RandomStream random(3);
  for (int round = 0; round < 200; ++round) {
    Matrix3d f[4];
    for (auto& m : f) m = random_matrix(random);  // half of them inside out
    Matrices rotation;
    nearest_rotations(four(f), rotation);
    for (int lane = 0; lane < 4; ++lane) {
      const Matrix3d r = lane_of(rotation, lane);
      EXPECT_LT((r.transpose() * r - Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_GT(r.determinant(), 0);
      EXPECT_NEAR((f[lane] - r).norm(), (f[lane] - by_definition(f[lane])).norm(), kWithin);
    }
  }
}

TEST(NearestRotations, LeaveRotationsAndStretchesAlone) {
  const Matrix3d turn =
      Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Matrix3d f[4] = {Matrix3d::Identity(), turn, turn * Eigen::Vector3d(0.2, 1, 5).asDiagonal(),
                         1e-3 * turn};
  Matrices rotation;
  nearest_rotations(four(f), rotation);
  EXPECT_TRUE(lane_of(rotation, 0) == Matrix3d::Identity()) << "bit for bit: rest is rest";
  for (int lane = 1; lane < 4; ++lane) EXPECT_LT((lane_of(rotation, lane) - turn).norm(), 1e-12);
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
