// SPDX-License-Identifier: Apache-2.0
// Eigen's dense solvers for matrices of any size, compiled in this one file because each takes long
// to compile.
#include "organbake/geometry/dense_solve.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace organbake {

Eigen::MatrixXd solve_symmetric(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                const Eigen::Ref<const Eigen::MatrixXd>& right) {
  return Eigen::LDLT<Eigen::MatrixXd>(matrix).solve(right);
}

std::optional<Eigen::VectorXd> solve_least_squares(const Eigen::Ref<const Eigen::MatrixXd>& rows,
                                                   const Eigen::Ref<const Eigen::VectorXd>& right) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(rows);
  if (factor.rank() < rows.cols()) return std::nullopt;
  return Eigen::VectorXd(factor.solve(right));
}

}  // namespace organbake
