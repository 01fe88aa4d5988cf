// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/refine.h"

namespace organbake {

// Covariance of what the solver moved, over patches: H⁻¹ (Σ g gᵀ) H⁻¹ (White 1980; clustered,
// Liang & Zeger 1986). Not finite where nothing holds it.
Eigen::MatrixXd sandwich_covariance(const Curvature& curvature);

}  // namespace organbake
