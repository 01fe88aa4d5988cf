// SPDX-License-Identifier: Apache-2.0
#include "deform/sparse_factor.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace organbake::deform {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// Panels may hold this share of explicit zeros: a wider panel costs less than the zeros do.
constexpr double kZeroShare = 1;
constexpr std::size_t kMostLots = 2;
constexpr std::uint32_t kMaxWidth = 64;  // keeps a panel's solution in the first-level cache

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

// The last column (exclusive) of the panel that starts at `first`: columns join while each one's
// first row is the next column, i.e. while the pattern is nested, and the zeros stay few.
std::uint32_t panel_end(std::uint32_t first, std::uint32_t size, const int* starts,
                        const int* row_of) {
  std::uint32_t last = first + 1;
  std::size_t entries = starts[first + 1] - starts[first];
  while (last < size && last - first < kMaxWidth) {
    const int begin = starts[last - 1];
    if (begin == starts[last] || row_of[begin] != static_cast<int>(last)) break;
    const std::size_t below = starts[last + 1] - starts[last];
    const std::size_t width = last + 1 - first;
    const std::size_t dense = width * below + width * (width - 1) / 2;
    if (dense > (1 + kZeroShare) * (entries + below)) break;
    entries += below;
    ++last;
  }
  return last;
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
  const Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(in_order);
  const Eigen::VectorXd diagonal = factor.vectorD();
  if (!scale.allFinite() || factor.info() != Eigen::Success || !(diagonal.array() > 0).all() ||
      !diagonal.allFinite()) {
    throw BadDataError(
        "the tissue's masses and springs make a system that is not positive definite; check for "
        "stiffnesses or masses that differ by more than 1e12");
  }
  position_.assign(to.indices().data(), to.indices().data() + size);
  scale_.resize(size);
  for (std::size_t i = 0; i < size; ++i) scale_[position_[i]] = scale[static_cast<int>(i)];
  inverse_diagonal_.resize(size);
  for (std::size_t i = 0; i < size; ++i)
    inverse_diagonal_[i] = static_cast<float>(1 / diagonal[static_cast<int>(i)]);
  const auto& lower = factor.matrixL().nestedExpression();
  const auto n = static_cast<std::uint32_t>(size);
  std::size_t most_blocks = 0;
  for (std::uint32_t first = 0; first < n;) {
    const std::uint32_t last = panel_end(first, n, lower.outerIndexPtr(), lower.innerIndexPtr());
    add_panel(first, last, lower.outerIndexPtr(), lower.innerIndexPtr(), lower.valuePtr());
    most_blocks = std::max<std::size_t>(most_blocks, panels_.back().blocks);
    first = last;
  }
  rows_.assign((size + 1) * 4 * kMostLots, 0.0F);
  planes_.assign(most_blocks * kBlockRows * 4 * kMostLots, 0.0F);
}

void SparseFactor::add_panel(std::uint32_t first, std::uint32_t last, const int* starts,
                             const int* row_of, const double* value_of) {
  const std::uint32_t width = last - first;
  const std::size_t below = starts[last] - starts[last - 1];
  const int* rows = row_of + starts[last - 1];
  std::vector<double> dense((width + below) * width, 0.0);  // row-major, the block on top
  for (std::uint32_t column = first; column < last; ++column) {
    for (int e = starts[column]; e < starts[column + 1]; ++e) {
      const auto row = static_cast<std::uint32_t>(row_of[e]);
      const std::size_t at = row < last
                                 ? row - first
                                 : width + (std::lower_bound(rows, rows + below, row_of[e]) - rows);
      dense[at * width + (column - first)] = value_of[e];
    }
  }
  invert_unit_block(width, dense);

  Panel panel;
  panel.first = first;
  panel.width = width;
  panel.blocks = static_cast<std::uint32_t>((below + kBlockRows - 1) / kBlockRows);
  panel.rows_at = row_index_.size();
  panel.values_at = values_.size();
  row_index_.insert(row_index_.end(), rows, rows + below);
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
void SparseFactor::solve_lots(const std::array<Row*, kLots>& lots) const {
  if (size() == 0) return;
  constexpr std::size_t kStride = std::size_t{4} * kLots;
  float* rows = rows_.data();
  const auto floats = [rows](std::size_t i, int lot) {
    return reinterpret_cast<Floats4*>(rows + i * kStride + std::size_t{4} * lot);
  };
  for (std::size_t i = 0; i < size(); ++i) {
    for (int lot = 0; lot < kLots; ++lot) {
      const Lanes scaled = scale_[i] * *as_lanes(lots[lot] + i);
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
      *as_lanes(lots[lot] + i) = scale_[i] * __builtin_convertvector(*floats(i, lot), Lanes);
    }
  }
}

void SparseFactor::solve(Row* rows) const { solve_lots<1, 4>({rows}); }
void SparseFactor::solve_points(Row* rows) const { solve_lots<1, 3>({rows}); }
void SparseFactor::solve_points(Row* first, Row* second) const {
  solve_lots<2, 3>({first, second});
}

}  // namespace organbake::deform
