// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/cost_functions/ncc_cost.h"

#include <algorithm>

#include "registration/cost_functions/pose_manifold.h"

namespace organbake {
namespace {

using RowMajor = NccBlock::RowMajor;

// Rows of a block: one a pixel, or its two slopes.
int rows_per_pixel(Similarity similarity) { return similarity == Similarity::gradient ? 2 : 1; }

// Calls row(i, of) for each row, `of` turning a function of the pixel into the row's value.
template <class Values, class Row>
void for_rows(const std::vector<WeightedPixel>& pixels, Similarity similarity,
              const Values& value, const Row& row) {
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
  for_rows(pixels, similarity, [&](int x, int y) { return Scalar(luminance(level, x, y)); },
           [&](Eigen::Index i, const Scalar& value) { values[i] = value[0]; });
  for (std::size_t i = 0; i < rows; ++i)
    weights[i] = pixels[i / rows_per_pixel(similarity)].weight;
  return NccBlock(values, weights);
}

}  // namespace

NccCost::NccCost(const LivePrediction& live, std::vector<WeightedPixel> pixels,
                 Similarity similarity)
    : live_(live),
      pixels_(std::move(pixels)),
      similarity_(similarity),
      block_(photo_block(live.level(), pixels_, similarity)) {
  set_num_residuals(block_.size());
  *mutable_parameter_block_sizes() = {7, live.basis().size(), 1};
}

Eigen::VectorXd NccCost::predicted() const {
  Eigen::VectorXd b(block_.size());
  for_rows(pixels_, similarity_, [&](int x, int y) { return Scalar(live_.radiance(x, y)); },
           [&](Eigen::Index i, const Scalar& value) { b[i] = value[0]; });
  return b;
}

void NccCost::fill(RowMajor& derivative, bool by_light) const {
  using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, ShadingBasis::kMost>;
  const int basis = live_.basis().size();
  const auto value = [&](int x, int y) -> Row {
    if (!by_light) return live_.derivative(x, y).transpose();
    Row phi(basis);
    for (int j = 0; j < basis; ++j) phi[j] = live_.phi(x, y, j);
    return phi;
  };
  for_rows(pixels_, similarity_, value,
           [&](Eigen::Index i, const Row& row) { derivative.row(i) = row; });
}

bool NccCost::Evaluate(double const* const* parameters, double* residuals,
                       double** jacobians) const {
  const Eigen::VectorXd b = predicted();
  block_.correlate(b, residuals);
  if (!jacobians) return true;
  if (jacobians[0] || jacobians[2]) {
    RowMajor by_motion(block_.size(), 7);
    fill(by_motion, false);
    block_.to_residual_derivative(b, by_motion);
    if (jacobians[0]) {
      RowMajor::Map(jacobians[0], block_.size(), 7).noalias() =
          by_motion.leftCols<6>() * PoseManifold::minus_jacobian(parameters[0]);
    }
    if (jacobians[2]) Eigen::VectorXd::Map(jacobians[2], block_.size()) = by_motion.col(6);
  }
  if (jacobians[1]) {
    RowMajor by_light(block_.size(), live_.basis().size());
    fill(by_light, true);
    block_.to_residual_derivative(b, by_light);
    RowMajor::Map(jacobians[1], by_light.rows(), by_light.cols()) = by_light;
  }
  return true;
}

}  // namespace organbake
