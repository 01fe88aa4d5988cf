// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/cost_function.h>

#include "depth/weighed_depth.h"

namespace organbake {

// Half the weighted squares of the depth's distances to the surface, with what is expected of its
// scale, times a factor. Parameters: pose (7), log scale (1). The matches stand while it is solved.
class DepthCost : public ceres::CostFunction {
 public:
  // All but the factor outlive the cost.
  DepthCost(const SeenDepth& depth, const WeighedDepth& weighed, const ScalePrior& prior,
            const Eigen::Vector3d& center_world_mm, double factor);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const SeenDepth& depth_;
  const WeighedDepth& weighed_;
  const ScalePrior& prior_;
  Eigen::Vector3d center_world_mm_;
  double factor_;
};

}  // namespace organbake
