// SPDX-License-Identifier: GPL-3.0-or-later
// Normalised cross-correlation as a sum of squares, ½‖â − b̂‖² = 1 − R, so that a least-squares
// solver climbs it, with its derivative by rank-one updates.
#include "appearance/ncc.h"

#include <cmath>

namespace organbake {
namespace {

using Eigen::VectorXd;

// Below this share of the values' own size, what varies is rounding.
constexpr double kConstant = 1e-9;

}  // namespace

NccBlock::NccBlock(const std::vector<double>& a, const std::vector<double>& weights)
    : weight_(VectorXd::Map(weights.data(), static_cast<Eigen::Index>(weights.size()))),
      root_weight_(weight_.cwiseSqrt()),
      weight_sum_(weight_.sum()) {
  const VectorXd values = VectorXd::Map(a.data(), static_cast<Eigen::Index>(a.size()));
  double norm = 0;
  a_hat_ = VectorXd::Zero(values.size());
  if (!(weight_sum_ > 0)) return;
  a_hat_ = normalised(values, norm);
  usable_ = norm > 0;
}

VectorXd NccBlock::normalised(const VectorXd& b, double& norm) const {
  const double mean = weight_.dot(b) / weight_sum_;
  VectorXd hat = root_weight_.cwiseProduct((b.array() - mean).matrix());
  norm = hat.norm();
  if (!(norm > kConstant * std::abs(mean) * std::sqrt(weight_sum_)) || !std::isfinite(norm)) {
    norm = 0;
    return VectorXd::Zero(b.size());
  }
  hat /= norm;
  return hat;
}

double NccBlock::correlate(const VectorXd& b, double* residual) const {
  double norm = 0;
  const VectorXd b_hat = usable_ ? normalised(b, norm) : VectorXd::Zero(b.size()).eval();
  if (residual) VectorXd::Map(residual, b.size()) = a_hat_ - b_hat;
  return a_hat_.dot(b_hat);
}

void NccBlock::to_residual_derivative(const VectorXd& b, RowMajor& derivative) const {
  double norm = 0;
  const VectorXd b_hat = usable_ ? normalised(b, norm) : VectorXd::Zero(b.size()).eval();
  if (!(norm > 0)) {
    derivative.setZero();
    return;
  }
  // Without temporaries of the matrix's size: this runs over every pixel of a photograph.
  const Eigen::RowVectorXd mean = weight_.transpose() * derivative / weight_sum_;
  Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(derivative.cols());
  for (Eigen::Index i = 0; i < derivative.rows(); ++i) {
    derivative.row(i) = root_weight_[i] * (derivative.row(i) - mean);
    along += b_hat[i] * derivative.row(i);
  }
  for (Eigen::Index i = 0; i < derivative.rows(); ++i)
    derivative.row(i) = (b_hat[i] * along - derivative.row(i)) / norm;
}

}  // namespace organbake
