// SPDX-License-Identifier: GPL-3.0-or-later
// Rotations as unit quaternions moved by rotation vectors, so that no pose is singular and none is
// counted twice.
#include "cost_functions/pose_manifold.h"

#include <algorithm>

namespace organbake {

// d (Exp(ω) q) / d ω at ω = 0: half the quaternion product (ω, 0) q.
PoseManifold::PlusMatrix PoseManifold::plus_jacobian(const double* q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  PlusMatrix j = PlusMatrix::Zero();
  j.topLeftCorner<4, 3>() << w, z, -y, -z, w, x, y, -x, w, -x, -y, -z;
  j.topLeftCorner<4, 3>() *= 0.5;
  j.bottomRightCorner<3, 3>().setIdentity();
  return j;
}

Eigen::Matrix<double, 6, 7, Eigen::RowMajor> PoseManifold::minus_jacobian(const double* x) {
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> inverse = plus_jacobian(x).transpose();
  inverse.topRows<3>() *= 4;  // the columns of the rotation part have length ½
  return inverse;
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const auto sum = moved(ObjectPose::from_array(x), Motion::Map(delta)).to_array();
  std::copy(sum.begin(), sum.end(), x_plus_delta);
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  PlusMatrix::Map(jacobian) = plus_jacobian(x);
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Motion::Map(y_minus_x) = motion_between(ObjectPose::from_array(x), ObjectPose::from_array(y));
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor>::Map(jacobian) = minus_jacobian(x);
  return true;
}

}  // namespace organbake
