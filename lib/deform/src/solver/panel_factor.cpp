// SPDX-License-Identifier: Apache-2.0
// The factor L D Lᵀ of a sparse symmetric matrix by dense panels of columns with one pattern
// (supernodes; Ng & Peyton 1993). In: the lower half in elimination order. Out: the panels, from
// left to right, each updated by the earlier ones that reach it.
#include "solver/panel_factor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake::deform {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

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

}  // namespace

std::vector<FactorPanel> factor_panels(const Matrix& lower) { return PanelFactor(lower).run(); }

bool is_positive(const std::vector<FactorPanel>& panels) {
  return std::all_of(panels.begin(), panels.end(), [](const FactorPanel& panel) {
    return std::all_of(panel.diagonal.begin(), panel.diagonal.end(),
                       [](double d) { return d > 0 && std::isfinite(d); });
  });
}

}  // namespace organbake::deform
