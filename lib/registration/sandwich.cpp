// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/pose_quality.h"

#include <Eigen/Cholesky>

namespace organbake {

Eigen::MatrixXd sandwich_covariance(const Curvature& curvature) {
  const Eigen::Index n = curvature.information.rows();
  Eigen::MatrixXd information = curvature.information;
  information.diagonal() *= 1 + 1e-12;
  const Eigen::MatrixXd inverse = information.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
  for (const Eigen::VectorXd& slope : curvature.patch_slopes) meat += slope * slope.transpose();
  return inverse * meat * inverse;
}

}  // namespace organbake
