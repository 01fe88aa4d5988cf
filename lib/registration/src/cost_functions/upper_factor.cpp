// SPDX-License-Identifier: GPL-3.0-or-later
// Cholesky's way, row by row, past columns that depend on those before.
#include "cost_functions/upper_factor.h"

#include <cmath>

namespace organbake {

Eigen::MatrixXd upper_factor(Eigen::MatrixXd gram) {
  constexpr double kDependent = 1e-13;  // of the column's own square
  const Eigen::Index n = gram.rows();
  Eigen::MatrixXd upper = Eigen::MatrixXd::Zero(n, n);
  const Eigen::VectorXd own = gram.diagonal();
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!(gram(k, k) > kDependent * own[k])) continue;
    const double pivot = std::sqrt(gram(k, k));
    for (Eigen::Index j = k; j < n; ++j) upper(k, j) = gram(k, j) / pivot;
    for (Eigen::Index i = k + 1; i < n; ++i)
      for (Eigen::Index j = k + 1; j < n; ++j) gram(i, j) -= upper(k, i) * upper(k, j);
  }
  return upper;
}

}  // namespace organbake
