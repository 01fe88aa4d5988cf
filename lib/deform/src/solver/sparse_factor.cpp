// SPDX-License-Identifier: Apache-2.0
// Orders, scales and factors a sparse matrix in double precision, L D Lᵀ by dense panels of columns
// with one pattern (supernodes; Ng & Peyton 1993), then stores the panels in single precision in
// the order in which a solve reads them. The diagonal blocks are inverted once, so that a solve is
// products alone.
#include "solver/sparse_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"

namespace organbake::deform {

// Columns of L with one pattern, dense (a supernode; Ng & Peyton 1993): `width` from `first` on,
// the unit lower triangular block and, below it, the rows that are listed.
struct FactorPanel {
  std::uint32_t first = 0, width = 0;
  std::vector<std::uint32_t> rows;  // increasing, all ≥ first + width
  std::vector<double> diagonal;     // of D
  std::vector<double> values;       // by column, each of width + rows.size(); above the diagonal 0

  std::size_t height() const { return width + rows.size(); }
  double* column(std::size_t c) { return values.data() + c * height(); }
  const double* column(std::size_t c) const { return values.data() + c * height(); }
};

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

// Panels may hold this share of explicit zeros: a wider panel costs less than the zeros do.
constexpr double kZeroShare = 1;
constexpr std::uint32_t kMaxWidth = 64;  // keeps a panel's solution in the first-level cache

// The rows below the diagonal of each column of L: those of the matrix, and of the columns that it
// is the parent of in the elimination tree.
std::vector<std::vector<std::uint32_t>> patterns(const Matrix& lower) {
  const auto n = static_cast<std::uint32_t>(lower.cols());
  std::vector<std::vector<std::uint32_t>> rows(n), children(n);
  std::vector<std::uint32_t> seen_by(n, std::numeric_limits<std::uint32_t>::max());
  for (std::uint32_t j = 0; j < n; ++j) {
    seen_by[j] = j;
    const auto take = [&](std::uint32_t row) {
      if (row <= j || seen_by[row] == j) return;
      seen_by[row] = j;
      rows[j].push_back(row);
    };
    for (Matrix::InnerIterator it(lower, static_cast<int>(j)); it; ++it)
      take(static_cast<std::uint32_t>(it.row()));
    for (const std::uint32_t child : children[j])
      for (const std::uint32_t row : rows[child]) take(row);
    std::sort(rows[j].begin(), rows[j].end());
    if (!rows[j].empty()) children[rows[j].front()].push_back(j);
  }
  return rows;
}

// Columns join while each one's first row is the next column, i.e. while the pattern is nested, and
// the zeros stay few.
std::uint32_t panel_end(std::uint32_t first, const std::vector<std::vector<std::uint32_t>>& rows) {
  std::uint32_t last = first + 1;
  std::size_t entries = rows[first].size();
  while (last < rows.size() && last - first < kMaxWidth) {
    if (rows[last - 1].empty() || rows[last - 1].front() != last) break;
    const std::size_t below = rows[last].size();
    const std::size_t width = last + 1 - first;
    const std::size_t dense = width * below + width * (width - 1) / 2;
    if (static_cast<double>(dense) > (1 + kZeroShare) * static_cast<double>(entries + below)) break;
    entries += below;
    ++last;
  }
  return last;
}

// to −= Σ by[k] · from[k], four at a time: what is summed stays in registers.
void subtract(double* __restrict to, std::size_t count, const double* const* from, const double* by,
              std::size_t terms) {
  std::size_t k = 0;
  for (; k + 4 <= terms; k += 4) {
    const double *a = from[k], *b = from[k + 1], *c = from[k + 2], *d = from[k + 3];
    const double p = by[k], q = by[k + 1], r = by[k + 2], s = by[k + 3];
    for (std::size_t i = 0; i < count; ++i) to[i] -= (p * a[i] + q * b[i]) + (r * c[i] + s * d[i]);
  }
  for (; k < terms; ++k)
    for (std::size_t i = 0; i < count; ++i) to[i] -= by[k] * from[k][i];
}

// L D Lᵀ of a symmetric matrix whose lower half is given, without pivoting, panel after panel, left
// to right. What is not positive definite leaves a diagonal that is_positive() refuses.
class PanelFactor {
 public:
  explicit PanelFactor(const Matrix& lower) : lower_(lower), place_(lower.cols()) {
    const auto rows = patterns(lower);
    panel_of_.resize(rows.size());
    for (std::uint32_t first = 0; first < rows.size();) {
      const std::uint32_t last = panel_end(first, rows);
      FactorPanel panel;
      panel.first = first, panel.width = last - first, panel.rows = rows[last - 1];
      for (std::uint32_t j = first; j < last; ++j)
        panel_of_[j] = static_cast<std::uint32_t>(panels_.size());
      panels_.push_back(std::move(panel));
      first = last;
    }
    waiting_.resize(panels_.size());
    next_row_.resize(panels_.size(), 0);
  }

  std::vector<FactorPanel> run() {
    for (std::uint32_t p = 0; p < panels_.size(); ++p) {
      fill(panels_[p]);
      for (const std::uint32_t earlier : waiting_[p]) update(panels_[p], earlier);
      factorise(panels_[p]);
      wait_for_next(p);
    }
    return std::move(panels_);
  }

 private:
  void fill(FactorPanel& panel) {
    panel.values.assign(panel.width * panel.height(), 0.0);
    for (std::uint32_t k = 0; k < panel.width; ++k) place_[panel.first + k] = k;
    for (std::size_t k = 0; k < panel.rows.size(); ++k)
      place_[panel.rows[k]] = static_cast<std::uint32_t>(panel.width + k);
    for (std::uint32_t c = 0; c < panel.width; ++c) {
      for (Matrix::InnerIterator it(lower_, static_cast<int>(panel.first + c)); it; ++it)
        panel.column(c)[place_[static_cast<std::size_t>(it.row())]] = it.value();
    }
  }

  // Takes what an earlier panel's columns leave for this one's.
  void update(FactorPanel& panel, std::uint32_t earlier_number) {
    FactorPanel& earlier = panels_[earlier_number];
    const std::size_t begin = next_row_[earlier_number], count = earlier.rows.size() - begin;
    std::size_t own = 0;  // of its rows that are columns of this panel
    while (own < count && earlier.rows[begin + own] < panel.first + panel.width) ++own;
    from_.resize(earlier.width), by_.resize(earlier.width), sum_.resize(count);
    for (std::size_t c = 0; c < own; ++c) {
      for (std::uint32_t k = 0; k < earlier.width; ++k) {
        from_[k] = earlier.column(k) + earlier.width + begin + c;
        by_[k] = from_[k][0] * earlier.diagonal[k];
      }
      std::fill_n(sum_.begin(), count - c, 0.0);
      subtract(sum_.data(), count - c, from_.data(), by_.data(), earlier.width);
      double* to = panel.column(earlier.rows[begin + c] - panel.first);
      for (std::size_t r = c; r < count; ++r) to[place_[earlier.rows[begin + r]]] += sum_[r - c];
    }
    next_row_[earlier_number] += own;
    wait_for_next(earlier_number);
  }

  void wait_for_next(std::uint32_t number) {
    const FactorPanel& panel = panels_[number];
    if (next_row_[number] < panel.rows.size())
      waiting_[panel_of_[panel.rows[next_row_[number]]]].push_back(number);
  }

  void factorise(FactorPanel& panel) {
    panel.diagonal.resize(panel.width);
    from_.resize(panel.width), by_.resize(panel.width);
    for (std::uint32_t c = 0; c < panel.width; ++c) {
      double* own = panel.column(c);
      for (std::uint32_t k = 0; k < c; ++k) {
        from_[k] = panel.column(k) + c;
        by_[k] = from_[k][0] * panel.diagonal[k];
      }
      subtract(own + c, panel.height() - c, from_.data(), by_.data(), c);
      panel.diagonal[c] = own[c];
      const double inverse = 1 / own[c];
      own[c] = 1;
      for (std::size_t r = c + 1; r < panel.height(); ++r) own[r] *= inverse;
    }
  }

  const Matrix& lower_;
  std::vector<FactorPanel> panels_;
  std::vector<std::uint32_t> panel_of_;              // by column
  std::vector<std::vector<std::uint32_t>> waiting_;  // panels, by the next that they update
  std::vector<std::size_t> next_row_;                // by panel, of its rows
  std::vector<std::uint32_t> place_;                 // by row, in the panel that is worked on
  std::vector<const double*> from_;
  std::vector<double> by_, sum_;
};

bool is_positive(const std::vector<FactorPanel>& panels) {
  return std::all_of(panels.begin(), panels.end(), [](const FactorPanel& panel) {
    return std::all_of(panel.diagonal.begin(), panel.diagonal.end(),
                       [](double d) { return d > 0 && std::isfinite(d); });
  });
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
  const std::vector<FactorPanel> panels = PanelFactor(in_order).run();
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
