// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <cstdint>
#include <vector>

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

// L D Lᵀ of a symmetric matrix whose lower half is given, without pivoting, panel after panel, left
// to right. What is not positive definite leaves a diagonal that is_positive() refuses.
std::vector<FactorPanel> factor_panels(const Eigen::SparseMatrix<double>& lower);
bool is_positive(const std::vector<FactorPanel>& panels);

}  // namespace organbake::deform
