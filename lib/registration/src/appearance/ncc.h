// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace organbake {

// Weighted normalised cross-correlation R of fixed values a with predicted values b (the paper's
// R, 2.1.1, with a weight per pixel), as a least-squares residual: with â, b̂ of weighted mean zero
// and unit norm,
//   r = â − b̂   and   ½‖r‖² = 1 − R exactly.
// b that is constant correlates with nothing: R = 0, b̂ = 0, no derivative.
class NccBlock {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // Equal lengths; weights ≥ 0.
  NccBlock(const std::vector<double>& a, const std::vector<double>& weights);

  int size() const { return static_cast<int>(a_hat_.size()); }
  // False when a is constant, so that nothing can be told.
  bool usable() const { return usable_; }
  // R in −1…1. `residual` (size() numbers) may be null.
  double correlate(const Eigen::VectorXd& b, double* residual) const;
  // d b / d p (size() rows) becomes d r / d p: db̂ = (I − b̂ b̂ᵀ) C db / ‖C b‖ with C the weighted
  // centring; rank-1 updates, never formed.
  void to_residual_derivative(const Eigen::VectorXd& b, RowMajor& derivative) const;

 private:
  // Centred and scaled b, and the norm it had.
  Eigen::VectorXd normalised(const Eigen::VectorXd& b, double& norm) const;

  Eigen::VectorXd a_hat_, weight_, root_weight_;
  double weight_sum_ = 0;
  bool usable_ = false;
};

}  // namespace organbake
