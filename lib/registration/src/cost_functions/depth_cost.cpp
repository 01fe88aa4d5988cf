// SPDX-License-Identifier: GPL-3.0-or-later
// Depth as a Ceres cost function: eight rows, the triangular factor of all of the points'.
#include "cost_functions/depth_cost.h"

#include "cost_functions/pose_manifold.h"
#include "cost_functions/upper_factor.h"

namespace organbake {

DepthCost::DepthCost(const SeenDepth& depth, const WeighedDepth& weighed, const ScalePrior& prior,
                     const Eigen::Vector3d& center_world_mm, double factor)
    : depth_(depth),
      weighed_(weighed),
      prior_(prior),
      center_world_mm_(center_world_mm),
      factor_(factor) {
  set_num_residuals(8);
  *mutable_parameter_block_sizes() = {7, 1};
}

bool DepthCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  using Row = Eigen::Matrix<double, 8, 1>;  // distance, motion, scale
  const DepthState state{ObjectPose::from_array(parameters[0]), parameters[1][0]};
  Eigen::Matrix<double, 8, 8> gram = Eigen::Matrix<double, 8, 8>::Zero();
  for (std::size_t i = 0; i < weighed_.matches.size(); ++i) {
    if (!(weighed_.weights[i] > 0)) continue;
    const DepthRow at = depth_row(depth_.points[i], weighed_.matches[i], state, center_world_mm_);
    Row row;
    row << at.distance, at.slope;
    gram += weighed_.weights[i] * row * row.transpose();
  }
  gram *= weighed_.trust;
  Row expected = Row::Zero();
  expected[0] = (state.log_scale - prior_.log_mean) / prior_.log_sd;
  expected[7] = 1 / prior_.log_sd;
  gram += expected * expected.transpose();
  const Eigen::MatrixXd upper = upper_factor(factor_ * gram);
  Row::Map(residuals) = upper.col(0);
  if (!jacobians) return true;
  using Slopes = Eigen::Matrix<double, 8, 7, Eigen::RowMajor>;
  if (jacobians[0])
    Slopes::Map(jacobians[0]) =
        upper.middleCols<6>(1) * PoseManifold::minus_jacobian(parameters[0]);
  if (jacobians[1]) Row::Map(jacobians[1]) = upper.col(7);
  return true;
}

}  // namespace organbake
