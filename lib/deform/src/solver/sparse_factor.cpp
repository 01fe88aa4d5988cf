// SPDX-License-Identifier: Apache-2.0
// Orders, scales and factors a sparse matrix in double precision, then stores the panels in single
// precision in the order in which a solve reads them. The diagonal blocks are inverted once, so
// that a solve is products alone.
#include "solver/sparse_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/error.h"
#include "solver/panel_factor.h"

namespace organbake::deform {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

constexpr std::size_t kMostLots = 2;

Matrix lower_half(std::size_t size, const std::vector<Coefficient>& coefficients) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(coefficients.size());
  for (const auto& c : coefficients) {
    triplets.emplace_back(std::max(c.i, c.j), std::min(c.i, c.j), c.value);
  }
  const auto n = static_cast<Eigen::Index>(size);
  Matrix matrix(n, n);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

// Where each unknown goes.
using Places = Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int>;
Places places(const Matrix& lower, UnknownOrder order) {
  Places to(lower.cols());
  to.setIdentity();
  if (order == UnknownOrder::given) return to;
  const Matrix all = lower.selfadjointView<Eigen::Lower>();
  Places from;
  Eigen::AMDOrdering<int>()(all, from);
  to = from.inverse();
  return to;
}

// The strictly lower part of a unit lower triangular block (row-major), replaced by its inverse's.
void invert_unit_block(std::size_t width, std::vector<double>& block) {
  for (std::size_t column = 0; column + 1 < width; ++column) {
    for (std::size_t row = column + 1; row < width; ++row) {
      double sum = block[row * width + column];
      for (std::size_t k = column + 1; k < row; ++k)
        sum += block[row * width + k] * block[k * width + column];
      block[row * width + column] = -sum;
    }
  }
}

}  // namespace

SparseFactor::SparseFactor(std::size_t size, const std::vector<Coefficient>& coefficients,
                           UnknownOrder order) {
  if (size == 0) return;
  Matrix matrix = lower_half(size, coefficients);
  // Scaled to a unit diagonal: what single precision then holds does not hang on the units.
  const Eigen::VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  matrix = scale.asDiagonal() * matrix * scale.asDiagonal();
  const Places to = places(matrix, order);
  Matrix in_order(matrix.rows(), matrix.cols());
  in_order.selfadjointView<Eigen::Lower>() = matrix.selfadjointView<Eigen::Lower>().twistedBy(to);
  const std::vector<FactorPanel> panels = factor_panels(in_order);
  if (!scale.allFinite() || !is_positive(panels)) {
    throw BadDataError(
        "the tissue's masses and springs make a system that is not positive definite; check for "
        "stiffnesses or masses that differ by more than 1e12");
  }
  position_.assign(to.indices().data(), to.indices().data() + size);
  scale_.resize(size);
  for (std::size_t i = 0; i < size; ++i) scale_[position_[i]] = scale[static_cast<int>(i)];
  std::size_t most_blocks = 0;
  for (const FactorPanel& panel : panels) {
    add_panel(panel);
    most_blocks = std::max<std::size_t>(most_blocks, panels_.back().blocks);
  }
  rows_.assign((size + 1) * 4 * kMostLots, 0.0F);
  planes_.assign(most_blocks * kBlockRows * 4 * kMostLots, 0.0F);
}

void SparseFactor::add_panel(const FactorPanel& factor) {
  const std::uint32_t width = factor.width;
  const std::size_t below = factor.rows.size();
  std::vector<double> dense((width + below) * width, 0.0);  // row-major, the block on top
  for (std::uint32_t column = 0; column < width; ++column) {
    inverse_diagonal_.push_back(static_cast<float>(1 / factor.diagonal[column]));
    for (std::size_t row = column + 1; row < width + below; ++row)
      dense[row * width + column] = factor.column(column)[row];
  }
  invert_unit_block(width, dense);

  Panel panel;
  panel.first = factor.first;
  panel.width = width;
  panel.blocks = static_cast<std::uint32_t>((below + kBlockRows - 1) / kBlockRows);
  panel.rows_at = row_index_.size();
  panel.values_at = values_.size();
  row_index_.insert(row_index_.end(), factor.rows.begin(), factor.rows.end());
  // The last block is filled up with a row of zeros that is nobody's.
  row_index_.resize(panel.rows_at + panel.blocks * kBlockRows, static_cast<std::uint32_t>(size()));
  values_.insert(values_.end(), dense.begin(),
                 dense.begin() + static_cast<std::ptrdiff_t>(std::size_t{width} * width));
  for (std::size_t block = 0; block < panel.blocks; ++block) {
    for (std::size_t column = 0; column < width; ++column) {
      for (std::size_t i = 0; i < kBlockRows; ++i) {
        const std::size_t row = block * kBlockRows + i;
        const double value = row < below ? dense[(width + row) * width + column] : 0;
        values_.push_back(static_cast<float>(value));
      }
    }
  }
  panels_.push_back(panel);
}

PanelView SparseFactor::view(const Panel& panel) const {
  const float* values = values_.data() + panel.values_at;
  return {panel.width, panel.blocks, values, values + std::size_t{panel.width} * panel.width,
          row_index_.data() + panel.rows_at};
}

template <int kLots, int kLanes>
void SparseFactor::solve_lots(const std::array<PaddedVector*, kLots>& lots) const {
  if (size() == 0) return;
  constexpr std::size_t kStride = std::size_t{4} * kLots;
  float* rows = rows_.data();
  const auto floats = [rows](std::size_t i, int lot) {
    return reinterpret_cast<Floats4*>(rows + i * kStride + std::size_t{4} * lot);
  };
  for (std::size_t i = 0; i < size(); ++i) {
    for (int lot = 0; lot < kLots; ++lot) {
      const Double4 scaled = scale_[i] * *as_double4(lots[lot] + i);
      *floats(i, lot) = __builtin_convertvector(scaled, Floats4);
    }
  }
  std::fill_n(rows + size() * kStride, kStride, 0.0F);
  for (const Panel& panel : panels_)
    eliminate<kLots, kLanes>(view(panel), rows + panel.first * kStride, rows);
  for (std::size_t i = 0; i < size(); ++i)
    for (int lot = 0; lot < kLots; ++lot) *floats(i, lot) *= inverse_diagonal_[i];
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {
    substitute<kLots, kLanes>(view(*panel), rows + panel->first * kStride, rows,
                              reinterpret_cast<Floats8*>(planes_.data()));
  }
  for (std::size_t i = 0; i < size(); ++i) {
    for (int lot = 0; lot < kLots; ++lot) {
      *as_double4(lots[lot] + i) = scale_[i] * __builtin_convertvector(*floats(i, lot), Double4);
    }
  }
}

void SparseFactor::solve(PaddedVector* rows) const { solve_lots<1, 4>({rows}); }
void SparseFactor::solve_points(PaddedVector* rows) const { solve_lots<1, 3>({rows}); }
void SparseFactor::solve_points(PaddedVector* first, PaddedVector* second) const {
  solve_lots<2, 3>({first, second});
}

}  // namespace organbake::deform
