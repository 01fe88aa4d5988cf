// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/manifold.h>

#include "organbake/registration/object_pose.h"

namespace organbake {

// ObjectPose as Ceres sees it: seven numbers that move by a Motion (six).
class PoseManifold : public ceres::Manifold {
 public:
  using PlusMatrix = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;

  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;

  static PlusMatrix plus_jacobian(const double* x);
  // Its left inverse: a derivative by the motion times this is a derivative by the seven numbers
  // that gives the former back on the manifold.
  static Eigen::Matrix<double, 6, 7, Eigen::RowMajor> minus_jacobian(const double* x);
};

}  // namespace organbake
