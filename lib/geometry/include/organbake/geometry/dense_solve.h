// SPDX-License-Identifier: Apache-2.0
// Small dense systems. Eigen's factorizations are templates that take GCC five to fifteen seconds
// in each file that uses one: these are compiled once.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace organbake {

// X of `matrix` · X = `right`, n × k, where the n × n matrix is symmetric and positive
// (semi-)definite: LDLᵀ with pivots. Its lower triangle alone is read. Not finite where neither is.
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                              const Eigen::Ref<const Eigen::MatrixXd>& right);

// The n numbers that bring `rows`, m × n, times them nearest to `right`, m numbers: QR with column
// pivots. Nothing where the rows do not fix all of them.
[[nodiscard]] std::optional<Eigen::VectorXd> solve_least_squares(
    const Eigen::Ref<const Eigen::MatrixXd>& rows, const Eigen::Ref<const Eigen::VectorXd>& right);

}  // namespace organbake
