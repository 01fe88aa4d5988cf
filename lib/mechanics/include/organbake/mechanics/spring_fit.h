// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// How far the springs' shape under a dead load lies from linear elasticity's on the same body:
// |u − u_fem| / |u_fem| over the proxy's vertices that give way, the median over the loads (one in
// each column, see dead_loads.h). Throws BadDataError as linear_statics.h does.
double spring_error(const TriangleMesh& proxy, const MechanicsModel& model,
                    const Eigen::MatrixXd& loads_n);

// The median errors under the loads of dead_loads.h.
struct SpringFitReport {
  double fitted_before = 0, fitted = 0;
  double held_out_before = 0, held_out = 0;
  int iterations = 0;
};

// Makes the springs' static shapes those of linear finite elements on the model's tetrahedra (see
// Lloyd et al. 2007 for why formulas don't): the stiffness of every spring under the fitted loads,
// by Levenberg–Marquardt on their logarithms, so that each stays positive. A small proxy (to about
// 90 vertices) gets springs between all its vertices first. Dampers keep their damping ratios.
// Throws UsageError for more springs than it can fit (about 4,000) and BadDataError for a model
// without tetrahedra or one that nothing holds.
SpringFitReport fit_springs_to_fem(const TriangleMesh& proxy, MechanicsModel& model,
                                   const RunContext& context = {});

}  // namespace organbake
