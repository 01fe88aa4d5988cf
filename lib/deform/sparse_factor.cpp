// SPDX-License-Identifier: Apache-2.0
#include "deform/sparse_factor.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <type_traits>

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

// A panel's part of a solve. Most panels are a few columns wide: for those the width is a constant,
// so that their solution stays in registers over all their rows.
template <int kWidth>
struct PanelSolve {
  std::size_t width, below;
  const double* value;
  const std::uint32_t* index;
  Lanes* own;
  Lanes* rows;

  std::size_t columns() const { return kWidth > 0 ? kWidth : width; }

  // Forward: the panel's own unknowns, then what they take from the rows below, four at a time:
  // four independent chains of multiply-adds share each load.
  void eliminate() const {
    const std::size_t w = columns();
    for (std::size_t k = 1; k < w; ++k) {
      Lanes sum = own[k];
      for (std::size_t q = 0; q < k; ++q) sum -= value[k * w + q] * own[q];
      own[k] = sum;
    }
    Lanes fixed[kWidth > 0 ? kWidth : 1];
    for (std::size_t k = 0; kWidth > 0 && k < w; ++k) fixed[k] = own[k];
    const Lanes* solved = kWidth > 0 ? fixed : own;
    const double* v = value + w * w;
    std::size_t r = 0;
    for (; r + 4 <= below; r += 4, v += 4 * w) {
      Lanes a = rows[index[r]], b = rows[index[r + 1]];
      Lanes c = rows[index[r + 2]], d = rows[index[r + 3]];
      for (std::size_t k = 0; k < w; ++k) {
        const Lanes y = solved[k];
        a -= v[k] * y;
        b -= v[k + w] * y;
        c -= v[k + 2 * w] * y;
        d -= v[k + 3 * w] * y;
      }
      rows[index[r]] = a, rows[index[r + 1]] = b, rows[index[r + 2]] = c, rows[index[r + 3]] = d;
    }
    for (; r < below; ++r, v += w) {
      Lanes a = rows[index[r]];
      for (std::size_t k = 0; k < w; ++k) a -= v[k] * solved[k];
      rows[index[r]] = a;
    }
  }

  // Backward: the same panel, transposed.
  void substitute() const {
    const std::size_t w = columns();
    Lanes fixed[kWidth > 0 ? kWidth : 1];
    for (std::size_t k = 0; kWidth > 0 && k < w; ++k) fixed[k] = own[k];
    Lanes* sum = kWidth > 0 ? fixed : own;
    const double* v = value + w * w;
    std::size_t r = 0;
    for (; r + 4 <= below; r += 4, v += 4 * w) {
      const Lanes a = rows[index[r]], b = rows[index[r + 1]];
      const Lanes c = rows[index[r + 2]], d = rows[index[r + 3]];
      for (std::size_t k = 0; k < w; ++k) {
        sum[k] -= (v[k] * a + v[k + w] * b) + (v[k + 2 * w] * c + v[k + 3 * w] * d);
      }
    }
    for (; r < below; ++r, v += w) {
      const Lanes a = rows[index[r]];
      for (std::size_t k = 0; k < w; ++k) sum[k] -= v[k] * a;
    }
    for (std::size_t k = w; k-- > 1;) {
      const Lanes known = sum[k];
      for (std::size_t q = 0; q < k; ++q) sum[q] -= value[k * w + q] * known;
    }
    for (std::size_t k = 0; kWidth > 0 && k < w; ++k) own[k] = fixed[k];
  }
};

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

template <typename Use>
void SparseFactor::with_panel(const Panel& panel, Lanes* lanes, const Use& use) const {
  const auto of_width = [&]<int kWidth>(std::integral_constant<int, kWidth>) {
    use(PanelSolve<kWidth>{panel.width, panel.below, values_.data() + panel.values_at,
                           row_index_.data() + panel.rows_at, lanes + panel.first, lanes});
  };
  switch (panel.width) {
    case 1: return of_width(std::integral_constant<int, 1>{});
    case 2: return of_width(std::integral_constant<int, 2>{});
    case 3: return of_width(std::integral_constant<int, 3>{});
    case 4: return of_width(std::integral_constant<int, 4>{});
    default: return of_width(std::integral_constant<int, 0>{});
  }
}

void SparseFactor::solve(Row* rows) const {
  Lanes* lanes = as_lanes(rows);
  for (const Panel& panel : panels_) {
    with_panel(panel, lanes, [](const auto& part) { part.eliminate(); });
  }
  for (std::size_t i = 0; i < size(); ++i) lanes[i] *= inverse_diagonal_[i];
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {
    with_panel(*panel, lanes, [](const auto& part) { part.substitute(); });
  }
}

}  // namespace organbake::deform
