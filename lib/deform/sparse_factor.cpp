// SPDX-License-Identifier: Apache-2.0
#include "deform/sparse_factor.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace organbake::deform {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// Panels may hold this share of explicit zeros: a wider panel costs less than the zeros do.
constexpr double kZeroShare = 0.3;
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

// Forward: the panel's own unknowns, then what they take from the rows below. Four rows at a time
// share each load of the solution and keep four independent chains of multiply-adds going.
void eliminate(std::size_t width, std::size_t below, const double* value,
               const std::uint32_t* index, Lanes* own, Lanes* rows) {
  for (std::size_t k = 1; k < width; ++k) {
    Lanes sum = own[k];
    for (std::size_t q = 0; q < k; ++q) sum -= value[k * width + q] * own[q];
    own[k] = sum;
  }
  value += width * width;
  std::size_t r = 0;
  for (; r + 4 <= below; r += 4, value += 4 * width) {
    Lanes a = rows[index[r]], b = rows[index[r + 1]];
    Lanes c = rows[index[r + 2]], d = rows[index[r + 3]];
    for (std::size_t k = 0; k < width; ++k) {
      const Lanes y = own[k];
      a -= value[k] * y;
      b -= value[k + width] * y;
      c -= value[k + 2 * width] * y;
      d -= value[k + 3 * width] * y;
    }
    rows[index[r]] = a, rows[index[r + 1]] = b, rows[index[r + 2]] = c, rows[index[r + 3]] = d;
  }
  for (; r < below; ++r, value += width) {
    Lanes a = rows[index[r]];
    for (std::size_t k = 0; k < width; ++k) a -= value[k] * own[k];
    rows[index[r]] = a;
  }
}

// Backward: the same panel, transposed.
void substitute(std::size_t width, std::size_t below, const double* block,
                const std::uint32_t* index, Lanes* own, Lanes* rows) {
  const double* value = block + width * width;
  std::size_t r = 0;
  for (; r + 4 <= below; r += 4, value += 4 * width) {
    const Lanes a = rows[index[r]], b = rows[index[r + 1]];
    const Lanes c = rows[index[r + 2]], d = rows[index[r + 3]];
    for (std::size_t k = 0; k < width; ++k) {
      own[k] -= (value[k] * a + value[k + width] * b) +
                (value[k + 2 * width] * c + value[k + 3 * width] * d);
    }
  }
  for (; r < below; ++r, value += width) {
    const Lanes a = rows[index[r]];
    for (std::size_t k = 0; k < width; ++k) own[k] -= value[k] * a;
  }
  for (std::size_t k = width; k-- > 1;) {
    const Lanes known = own[k];
    for (std::size_t q = 0; q < k; ++q) own[q] -= block[k * width + q] * known;
  }
}

}  // namespace

SparseFactor::SparseFactor(std::size_t size, const std::vector<Coefficient>& coefficients) {
  if (size == 0) return;
  const Eigen::SimplicialLDLT<Matrix, Eigen::Lower> factor(lower_half(size, coefficients));
  const Eigen::VectorXd diagonal = factor.vectorD();
  if (factor.info() != Eigen::Success || !(diagonal.array() > 0).all() || !diagonal.allFinite()) {
    throw BadDataError(
        "the tissue's masses and springs make a system that is not positive definite; check for "
        "stiffnesses or masses that differ by more than 1e12");
  }
  const auto& order = factor.permutationP().indices();
  position_.assign(order.data(), order.data() + size);
  inverse_diagonal_.resize(size);
  Eigen::Map<Eigen::VectorXd>(inverse_diagonal_.data(), diagonal.size()) = diagonal.cwiseInverse();
  const auto& lower = factor.matrixL().nestedExpression();
  const auto n = static_cast<std::uint32_t>(size);
  for (std::uint32_t first = 0; first < n;) {
    const std::uint32_t last = panel_end(first, n, lower.outerIndexPtr(), lower.innerIndexPtr());
    add_panel(first, last, lower.outerIndexPtr(), lower.innerIndexPtr(), lower.valuePtr());
    first = last;
  }
}

void SparseFactor::add_panel(std::uint32_t first, std::uint32_t last, const int* starts,
                             const int* row_of, const double* value_of) {
  Panel panel;
  panel.first = first;
  panel.width = last - first;
  panel.below = starts[last] - starts[last - 1];
  panel.rows_at = row_index_.size();
  panel.values_at = values_.size();
  const int* rows = row_of + starts[last - 1];
  row_index_.insert(row_index_.end(), rows, rows + panel.below);
  values_.resize(values_.size() + std::size_t{panel.width} * (panel.width + panel.below), 0.0);
  double* block = values_.data() + panel.values_at;
  for (std::uint32_t column = first; column < last; ++column) {
    for (int e = starts[column]; e < starts[column + 1]; ++e) {
      const auto row = static_cast<std::uint32_t>(row_of[e]);
      const std::size_t at =
          row < last ? row - first
                     : panel.width + (std::lower_bound(rows, rows + panel.below, row_of[e]) - rows);
      block[at * panel.width + (column - first)] = value_of[e];
    }
  }
  panels_.push_back(panel);
}

void SparseFactor::solve(Row* rows) const {
  Lanes* lanes = as_lanes(rows);
  for (const Panel& panel : panels_) {
    eliminate(panel.width, panel.below, values_.data() + panel.values_at,
              row_index_.data() + panel.rows_at, lanes + panel.first, lanes);
  }
  for (std::size_t i = 0; i < size(); ++i) lanes[i] *= inverse_diagonal_[i];
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {
    substitute(panel->width, panel->below, values_.data() + panel->values_at,
               row_index_.data() + panel->rows_at, lanes + panel->first, lanes);
  }
}

}  // namespace organbake::deform
