// SPDX-License-Identifier: GPL-3.0-or-later
// The correlation as a Ceres cost function. Residual and Jacobian are handed over as the triangular
// factor of their QR decomposition: a dozen rows in place of a photograph's, in sums of fixed
// order.
#include "cost_functions/ncc_cost.h"

#include <algorithm>
#include <cmath>

#include "cost_functions/pose_manifold.h"
#include "cost_functions/upper_factor.h"

namespace organbake {
namespace {

using RowMajor = NccBlock::RowMajor;

// Linearization of a block: one a pixel, or its two slopes.
int rows_per_pixel(Similarity similarity) { return similarity == Similarity::gradient ? 2 : 1; }

// Calls row(i, of) for each row, `of` turning a function of the pixel into the row's value.
template <class Values, class Row>
void for_rows(const std::vector<WeightedPixel>& pixels, Similarity similarity, const Values& value,
              const Row& row) {
  Eigen::Index i = 0;
  for (const WeightedPixel& p : pixels) {
    if (similarity == Similarity::radiance) {
      row(i++, value(p.x, p.y));
    } else {
      row(i++, (value(p.x + 1, p.y) - value(p.x - 1, p.y)).eval());
      row(i++, (value(p.x, p.y + 1) - value(p.x, p.y - 1)).eval());
    }
  }
}

using Scalar = Eigen::Matrix<double, 1, 1>;

// Slopes at the level's edge take the edge's own value for what lies beyond.
double luminance(const PhotoLevel& level, int x, int y) {
  const int u = std::clamp(x, 0, level.intrinsics.width - 1);
  const int v = std::clamp(y, 0, level.intrinsics.height - 1);
  return level.luminance[level.index(u, v)];
}

NccBlock photo_block(const PhotoLevel& level, const std::vector<WeightedPixel>& pixels,
                     Similarity similarity) {
  const std::size_t rows = pixels.size() * rows_per_pixel(similarity);
  std::vector<double> values(rows), weights(rows);
  for_rows(
      pixels, similarity, [&](int x, int y) { return Scalar(luminance(level, x, y)); },
      [&](Eigen::Index i, const Scalar& value) { values[i] = value[0]; });
  for (std::size_t i = 0; i < rows; ++i) weights[i] = pixels[i / rows_per_pixel(similarity)].weight;
  return NccBlock(values, weights);
}

}  // namespace

NccCost::NccCost(const LivePrediction& live, std::vector<WeightedPixel> pixels,
                 Similarity similarity)
    : live_(live),
      pixels_(std::move(pixels)),
      similarity_(similarity),
      block_(photo_block(live.level(), pixels_, similarity)) {
  const int basis = live.basis().size();
  set_num_residuals(1 + 7 + basis);
  *mutable_parameter_block_sizes() = {7, basis, 1};
}

Eigen::VectorXd NccCost::predicted() const {
  Eigen::VectorXd b(block_.size());
  for_rows(
      pixels_, similarity_, [&](int x, int y) { return Scalar(live_.radiance(x, y)); },
      [&](Eigen::Index i, const Scalar& value) { b[i] = value[0]; });
  return b;
}

NccCost::Linearization NccCost::linearization() const {
  constexpr int kMost = 7 + ShadingBasis::kMost;
  using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMost>;
  const int basis = live_.basis().size();
  const auto value = [&](int x, int y) -> Row {
    Row row(7 + basis);
    row.head<7>() = live_.derivative(x, y).transpose();
    for (int j = 0; j < basis; ++j) row[7 + j] = live_.phi(x, y, j);
    return row;
  };
  Linearization both{Eigen::VectorXd(block_.size()), RowMajor(block_.size(), 7 + basis)};
  for_rows(pixels_, similarity_, value,
           [&](Eigen::Index i, const Row& row) { both.derivative.row(i) = row; });
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
    RowMajor::Map(jacobians[0], n, 7) = by_motion * PoseManifold::minus_jacobian(parameters[0]);
  }
  const Eigen::Index basis = live_.basis().size();
  if (jacobians[1]) RowMajor::Map(jacobians[1], n, basis) = upper.rightCols(basis);
  if (jacobians[2])
    Eigen::VectorXd::Map(jacobians[2], n) = upper.col(7) + parameters[0][6] * scale * upper.col(6);
  return true;
}

}  // namespace organbake
