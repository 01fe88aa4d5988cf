// SPDX-License-Identifier: GPL-3.0-or-later
// What is minimised over a pose: the correlation of photograph and rendering, and the agreement
// with depth, each as a cost function of Ceres over one rendering that they share. Rotations are
// unit quaternions moved by rotation vectors, so that no pose is singular and none is counted
// twice.
#include "cost_functions/cost_functions.h"

#include <algorithm>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using Eigen::VectorXd;

// Below this share of the values' own size, what varies is rounding.
constexpr double kConstant = 1e-9;

using RowMajor = NccBlock::RowMajor;

NccBlock photo_block(const PhotoLevel& level, const std::vector<WeightedPixel>& pixels) {
  std::vector<double> values, weights;
  for (const WeightedPixel& p : pixels) {
    values.push_back(level.luminance[level.index(p.x, p.y)]);
    weights.push_back(p.weight);
  }
  return NccBlock(values, weights);
}

// U of a Gram matrix GᵀG = UᵀU; rows of what depends on those before are zero. Cost functions hand
// the solver U for G: the same cost and slopes in a few rows, and sums of fixed order.
// Cholesky's way, row by row, past columns that depend on those before.
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

}  // namespace

// The quaternion is Exp(ω) q: dq = ½ (ω, 0) q, whose inverse on unit quaternions is twice the
// transposed product.
Eigen::Matrix<double, 6, 7, Eigen::RowMajor> motion_by_numbers(const double* pose) {
  const double x = pose[0], y = pose[1], z = pose[2], w = pose[3];
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> m = Eigen::Matrix<double, 6, 7>::Zero();
  m.topLeftCorner<3, 4>() << w, -z, y, -x, z, w, -x, -y, -y, x, w, -z;
  m.topLeftCorner<3, 4>() *= 2;
  m.bottomRightCorner<3, 3>().setIdentity();
  return m;
}

// The rendering that all cost functions of a problem share, drawn once for each state that the
// solver visits; tracing rays is what costs.

double pixels_moved(const PhotoLevel& level, const RegisteredSurface& surface,
                    const SolverState& from, const SolverState& to) {
  const ObjectPose pose = from.object_pose();
  const Motion motion = motion_between(pose, to.object_pose());
  const double depth = std::max(1e-9, pose.center_camera_mm.z());
  const double mm = motion.head<3>().norm() * surface.radius_mm() + motion.segment<2>(3).norm() +
                    std::abs(motion[5]) * surface.radius_mm() / depth;
  return level.intrinsics.fx * mm / depth +
         std::abs(to.log_focal - from.log_focal) * level.intrinsics.width / 2;
}

// Tracing is what costs: a state that only differs in its light is lit anew, one that was drawn
// last is not drawn again.
void LivePrediction::PrepareForEvaluation(bool evaluate_jacobians, bool) {
  const bool placed =
      drawn_ && drawn_state_.pose == state_.pose && drawn_state_.log_focal == state_.log_focal;
  if (!placed) {
    constexpr double kClose = 0.7;  // pixels: an outline stays within the pixels next to it
    settings_.keep_faces = drawn_ && pixels_moved(level_, surface_, traced_state_, state_) < kClose;
    if (!settings_.keep_faces) traced_state_ = state_;
    predict(surface_, level_, state_.object_pose(), std::exp(state_.log_focal), basis_,
            state_.light, settings_, prediction_);
  } else if (drawn_state_.light != state_.light) {
    relight(prediction_, state_.light);
  }
  if (!placed || drawn_state_.light != state_.light) derived_ = false;
  drawn_state_ = state_;
  drawn_ = true;
  if (!evaluate_jacobians || derived_) return;
  settled_ = settles();
  if (!settled_) derive();
}

bool LivePrediction::settles() const {
  if (derivations_ == 0) return false;
  return derivations_ >= most_derivations_ ||
         pixels_moved(level_, surface_, derived_state_, state_) < settled_px_;
}

void LivePrediction::derive() {
  Intrinsics lens = level_.intrinsics;
  lens.fx *= std::exp(state_.log_focal);
  lens.fy *= std::exp(state_.log_focal);
  const Eigen::Vector3d center = state_.object_pose().center_camera_mm;
  derivatives_.resize(prediction_.radiance.size());
  parallel_for(0, prediction_.height, [&](int row) {
    const int y = prediction_.top + row;
    for (int x = prediction_.left; x < prediction_.left + prediction_.width; ++x) {
      const PixelDerivative d =
          pixel_derivative(prediction_, lens, center, basis_, state_.light, x, y);
      for (int j = 0; j < 7; ++j)
        derivatives_[prediction_.index(x, y)][j] = static_cast<float>(d[j]);
    }
  });
  derived_ = true;
  derived_state_ = state_;
  ++derivations_;
}

double LivePrediction::radiance(int x, int y) const {
  if (prediction_.contains(x, y)) return prediction_.radiance[prediction_.index(x, y)];
  return state_.light[basis_.size() - 1];
}

double LivePrediction::phi(int x, int y, int j) const {
  if (prediction_.contains(x, y)) return prediction_.phi_at(prediction_.index(x, y))[j];
  return j == basis_.size() - 1 ? 1 : 0;
}

PixelDerivative LivePrediction::derivative(int x, int y) const {
  PixelDerivative d = PixelDerivative::Zero();
  if (!prediction_.contains(x, y)) return d;
  const auto& stored = derivatives_[prediction_.index(x, y)];
  for (int j = 0; j < 7; ++j) d[j] = stored[j];
  return d;
}

// Normalised cross-correlation as a sum of squares, ½‖â − b̂‖² = 1 − R, so that a least-squares
// solver climbs it, with its derivative by rank-one updates.

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

// The correlation as a Ceres cost function. Residual and Jacobian are handed over as the triangular
// factor of their QR decomposition: a dozen rows in place of a photograph's, in sums of fixed
// order.

NccCost::NccCost(const LivePrediction& live, std::vector<WeightedPixel> pixels)
    : live_(live), pixels_(std::move(pixels)), block_(photo_block(live.level(), pixels_)) {
  const int basis = live.basis().size();
  set_num_residuals(1 + 7 + basis);
  *mutable_parameter_block_sizes() = {7, basis, 1};
}

Eigen::VectorXd NccCost::predicted() const {
  Eigen::VectorXd b(block_.size());
  for (Eigen::Index i = 0; i < b.size(); ++i) b[i] = live_.radiance(pixels_[i].x, pixels_[i].y);
  return b;
}

NccCost::Linearization NccCost::linearization() const {
  const int basis = live_.basis().size();
  Linearization both{Eigen::VectorXd(block_.size()), RowMajor(block_.size(), 7 + basis)};
  for (Eigen::Index i = 0; i < block_.size(); ++i) {
    const auto& [x, y, weight, trust] = pixels_[i];
    both.derivative.row(i).head<7>() = live_.derivative(x, y).transpose();
    for (int j = 0; j < basis; ++j) both.derivative(i, 7 + j) = live_.phi(x, y, j);
  }
  const Eigen::VectorXd b = predicted();
  block_.correlate(b, both.residual.data());
  block_.to_residual_derivative(b, both.derivative);
  return both;
}

bool NccCost::Evaluate(double const* const* parameters, double* residuals,
                       double** jacobians) const {
  std::fill_n(residuals, num_residuals(), 0.0);
  if (!jacobians || live_.settled()) {
    const double correlation = this->correlation();
    residuals[0] = std::sqrt(std::max(0.0, block_.usable() ? 2 * (1 - correlation) : 0.0));
    for (std::size_t block = 0; jacobians && block < parameter_block_sizes().size(); ++block)
      if (jacobians[block])
        std::fill_n(jacobians[block], num_residuals() * parameter_block_sizes()[block], 0.0);
    return true;
  }
  const Linearization all = linearization();
  const Eigen::Index n = num_residuals();
  RowMajor stacked(all.residual.size(), n);
  stacked << all.residual, all.derivative;
  const Eigen::MatrixXd upper = upper_factor(stacked.transpose() * stacked);
  residuals[0] = upper(0, 0);
  // The solver's own z (SolverState) is the organ's over the focal length's scale.
  const double scale = std::exp(*parameters[2]);
  if (jacobians[0]) {
    Eigen::MatrixXd by_motion = upper.middleCols<6>(1);
    by_motion.col(5) *= scale;
    RowMajor::Map(jacobians[0], n, 7) = by_motion * motion_by_numbers(parameters[0]);
  }
  const Eigen::Index basis = live_.basis().size();
  if (jacobians[1]) RowMajor::Map(jacobians[1], n, basis) = upper.rightCols(basis);
  if (jacobians[2])
    Eigen::VectorXd::Map(jacobians[2], n) = upper.col(7) + parameters[0][6] * scale * upper.col(6);
  return true;
}

// Depth as a Ceres cost function: eight rows, the triangular factor of all of the points'.

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
    Slopes::Map(jacobians[0]) = upper.middleCols<6>(1) * motion_by_numbers(parameters[0]);
  if (jacobians[1]) Row::Map(jacobians[1]) = upper.col(7);
  return true;
}

}  // namespace organbake
