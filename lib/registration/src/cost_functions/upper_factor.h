// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace organbake {

// U of a Gram matrix GᵀG = UᵀU; rows of what depends on those before are zero. Cost functions hand
// the solver U for G: the same cost and slopes in a few rows, and sums of fixed order.
Eigen::MatrixXd upper_factor(Eigen::MatrixXd gram);

}  // namespace organbake
